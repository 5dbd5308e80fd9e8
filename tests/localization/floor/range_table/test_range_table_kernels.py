import numpy as np

from racecar.localization.floor.range_table.range_table_kernels import MOVABLE, OPEN, WALL, view_columns

KINDS = np.full((4, 6), OPEN, dtype=np.uint8)
KINDS[0] = WALL
KINDS[2, 3:5] = MOVABLE
KINDS[3, 1] = MOVABLE
VIEWPOINTS = np.array([[2.5, 3.5], [3.0, 1.0], [2.5, 0.5], [1.5, 5.5]], dtype=np.float32)


def test_movable_cells_are_listed_column_by_column() -> None:
    view = view_columns(KINDS, VIEWPOINTS)
    listed = [view.movable_rows[view.first_movable[c] : view.first_movable[c + 1]].tolist() for c in range(4)]
    assert listed == [[], [], [3, 4], [1]]


def test_viewpoints_are_listed_column_by_column_under_their_numbers() -> None:
    view = view_columns(KINDS, VIEWPOINTS)
    listed = [view.numbers[view.first_viewpoint[c] : view.first_viewpoint[c + 1]].tolist() for c in range(4)]
    assert listed == [[], [3], [0, 1, 2], []]
    by_number = np.argsort(view.numbers)
    assert view.viewpoint_rows[by_number].tolist() == [3, 0, 0, 5]
    assert view.is_corner[by_number].tolist() == [0, 1, 0, 0]
    assert view.is_inside[by_number].tolist() == [1, 0, 0, 0]


def test_cells_of_a_column_lie_side_by_side_also_when_rows_are_taken_for_columns() -> None:
    view = view_columns(KINDS.T, VIEWPOINTS[:, ::-1])
    assert view.kinds.flags.c_contiguous
    assert view.kinds.shape == (6, 4)
