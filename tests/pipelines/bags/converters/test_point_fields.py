"""The fields of point clouds, as drivers really fill them."""

import numpy as np
import pytest

from racecar.pipelines.bags.converters.point_fields import positions, time_offsets
from racecar.pipelines.bags.messages import POINT_CLOUD, ros2_types
from tests.pipelines.bag_samples import header

KINDS = {"i4": 5, "u4": 6, "f4": 7, "f8": 8}
SECONDS, NANOSECONDS = 1_700_000_000, 250_000_000


def message(**columns):
    """A cloud with the given columns (N,), each of its own type."""
    types, count = ros2_types().types, len(next(iter(columns.values())))
    table = np.zeros(count, dtype=[(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        table[name] = values
    field = types["sensor_msgs/msg/PointField"]
    return types[POINT_CLOUD](
        header=header(types, SECONDS * 10**9 + NANOSECONDS),
        height=1,
        width=count,
        fields=[
            field(name=name, offset=offset, datatype=KINDS[kind.str[1:]], count=1)
            for name, (kind, offset) in table.dtype.fields.items()
        ],
        is_bigendian=False,
        point_step=table.dtype.itemsize,
        row_step=table.nbytes,
        data=table.view(np.uint8).ravel(),
        is_dense=True,
    )


XYZ = {name: np.array([1.0, 2.0, 3.0], dtype="f4") for name in "xyz"}
STAMP = SECONDS + NANOSECONDS * 1e-9


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("t", np.array([0, 50_000_000, 99_000_000], dtype="u4")),  # Ouster
        ("time", np.array([0.0, 0.05, 0.099], dtype="f4")),  # Velodyne
        ("timestamp", STAMP + np.array([0.0, 0.05, 0.099])),  # Hesai, Robosense
        ("timestamp", (STAMP + np.array([0.0, 0.05, 0.099])) * 1e9),  # Livox
        ("offset_time", np.array([0, 50_000_000, 99_000_000], dtype="u4")),
    ],
)
def test_times_of_many_makes(name, values):
    np.testing.assert_allclose(time_offsets(message(**XYZ, **{name: values})), [0.0, 0.05, 0.099], atol=1e-6)


def test_stamp_at_the_end_of_the_turn():
    times = np.array([-0.099, -0.05, 0.0], dtype="f4")
    np.testing.assert_allclose(time_offsets(message(**XYZ, time=times)), times)


@pytest.mark.parametrize(
    "times", [[0.0, 50.0, 99.0], [0.0, np.nan, 0.1], [3e5, 3e5, 3e5], [STAMP + 40.0, STAMP, STAMP]]
)
def test_times_that_cannot_be_true(times):
    assert np.isnan(time_offsets(message(**XYZ, time=np.array(times)))).all()


def test_no_times():
    assert time_offsets(message(**XYZ)) is None
    assert time_offsets(message(**{name: np.empty(0, dtype="f4") for name in ("x", "y", "time")})) is None


def test_cloud_without_heights_lies_at_zero():
    np.testing.assert_array_equal(
        positions(message(x=XYZ["x"], y=XYZ["y"])), [[1, 1, 0], [2, 2, 0], [3, 3, 0]]
    )


def test_cloud_that_does_not_hold_what_it_announces():
    cut = message(**XYZ)
    cut.data = cut.data[:-1]
    beyond = message(**XYZ)
    beyond.fields[2].offset = 10
    for broken in (
        cut,
        beyond,
        message(x=XYZ["x"], z=XYZ["z"]),
        message(**{**XYZ, "z": np.arange(3, dtype="i4")}),
    ):
        assert positions(broken) is None


@pytest.mark.parametrize(
    ("height", "width", "row_step"),
    [(10**9, 10**9, 0), (10**9, 3, 36), (1, 10**9, 36), (2**32 - 1, 2**32 - 1, 2**32 - 1)],
)
def test_a_cloud_that_announces_any_number_of_points_takes_no_memory(height, width, row_step):
    cloud = message(**XYZ, time=np.zeros(3, dtype="f4"))
    cloud.height, cloud.width, cloud.row_step = height, width, row_step
    assert positions(cloud) is None
    assert time_offsets(cloud) is None


@pytest.mark.parametrize(("height", "width"), [(0, 0), (0, 3), (0, 10**9), (3, 0)])
def test_a_cloud_without_rows_or_columns_has_no_points(height, width):
    cloud = message(**XYZ)
    cloud.height, cloud.width = height, width
    cloud.row_step = width * cloud.point_step
    points = positions(cloud)
    assert points is None or len(points) == 0


@pytest.mark.filterwarnings("error")
def test_damaged_numbers_are_converted_without_a_warning():
    signalling = np.array([0x7FA00000] * 3, dtype="u4").view("f4")
    cloud = message(x=XYZ["x"], y=XYZ["y"], z=signalling, time=signalling)
    assert np.isnan(positions(cloud)[:, 2]).all()
    assert np.isnan(time_offsets(cloud)).all()
