"""The map as a PLY file."""

from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.files.point_map import save_point_map


def points_of(path: Path) -> np.ndarray:
    """(N, 3) as any reader of binary PLY finds them."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    assert b"format binary_little_endian" in header
    count = int(header.split(b"element vertex ")[1].split()[0])
    assert header.count(b"property double") == 3
    return np.frombuffer(body, dtype="<f8").reshape(count, 3)


def test_points_are_thinned_and_stay_in_place(tmp_path: Path) -> None:
    wall = np.column_stack([np.linspace(0.0, 10.0, 5001), np.full(5001, -2.0)]).astype(np.float32)
    save_point_map(wall, 0.05, tmp_path / "points.ply")
    x, y, z = points_of(tmp_path / "points.ply").T
    assert 200 <= len(x) <= 202
    np.testing.assert_allclose(np.diff(np.sort(x)), 0.05, atol=0.03)
    np.testing.assert_allclose(y, -2.0)
    assert not z.any()


def test_place_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match=r"points\.ply"):
        save_point_map(np.zeros((1, 2), dtype=np.float32), 0.05, tmp_path / "file" / "points.ply")
