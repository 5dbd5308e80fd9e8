import numpy as np

from racecar.pipelines.simulation.floor_canvas import FloorCanvas


def test_an_open_place_is_walled_one_cell_thick() -> None:
    canvas = FloorCanvas((0.0, 0.0), (0.5, 0.4), resolution=0.1)
    canvas.open_box(0.1, 0.1, 0.4, 0.3)
    canvas.solid_box(0.2, 0.1, 0.3, 0.2)
    expected = [
        [100, 100, 100, 100, 100],
        [100, 0, 100, 0, 100],
        [100, 0, 0, 0, 100],
        [100, 100, 100, 100, 100],
    ]
    np.testing.assert_array_equal(canvas.finish().cells, expected)
