"""The map as a PLY file."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.maps.errors import UserError
from racecar.pipelines.files.point_map import save_point_map

COLORS = ("red", "green", "blue")


def read_ply(path: Path) -> np.ndarray:
    """The vertices by the names of their properties, as any reader of binary PLY finds them."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    assert "format binary_little_endian 1.0" in lines
    (count,) = (int(line.split()[2]) for line in lines if line.startswith("element vertex "))
    types = {"double": "<f8", "uchar": "u1"}
    fields = [line.split()[1:] for line in lines if line.startswith("property ")]
    return np.frombuffer(body, dtype=[(name, types[kind]) for kind, name in fields], count=count)


def test_points_are_thinned_and_stay_in_place(tmp_path: Path) -> None:
    wall = np.column_stack([np.linspace(0.0, 10.0, 5001), np.full(5001, -2.0), np.zeros(5001)])
    save_point_map([wall], 0.05, tmp_path / "points.ply")
    points = read_ply(tmp_path / "points.ply")
    assert 200 <= len(points) <= 202
    np.testing.assert_allclose(np.diff(np.sort(points["x"])), 0.05, atol=0.03)
    np.testing.assert_allclose(points["y"], -2.0)
    assert not points["z"].any()
    assert not set(COLORS) & set(points.dtype.names or ())


def test_clouds_are_coloured_by_height(tmp_path: Path) -> None:
    column = np.column_stack([np.zeros((100, 2)), np.linspace(0.0, 2.0, 100)])
    save_point_map([column, column], 0.1, tmp_path / "points.ply")
    points = np.sort(read_ply(tmp_path / "points.ply"), order="z")
    assert 20 <= len(points) <= 22
    low, high = points[0], points[-1]
    assert low["blue"] > low["red"]
    assert high["red"] > high["blue"]


@settings(deadline=None, max_examples=20)
@given(
    sizes=st.lists(st.integers(0, 30), max_size=4).filter(any),
    spacing=st.floats(0.01, 2.0),
    seed=st.integers(0, 1000),
)
def test_all_clouds_are_within_a_spacing_of_what_is_written(
    tmp_path_factory: pytest.TempPathFactory, sizes: list[int], spacing: float, seed: int
) -> None:
    path, generator = tmp_path_factory.mktemp("ply") / "points.ply", np.random.default_rng(seed)
    clouds = [generator.uniform(-3.0, 3.0, (size, 3)) for size in sizes]
    save_point_map(clouds, spacing, path)
    points = read_ply(path)
    written = np.column_stack([points[name] for name in "xyz"])
    for point in np.concatenate([np.empty((0, 3)), *clouds]):
        assert np.abs(written - point).max(axis=1).min() <= 2 * spacing
    assert len(written) <= sum(sizes)


def test_place_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match=r"points\.ply"):
        save_point_map([np.zeros((1, 3))], 0.05, tmp_path / "file" / "points.ply")
