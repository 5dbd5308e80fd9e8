"""A race track as the optimizers of TUM read it."""

from pathlib import Path

import numpy as np

from racecar.maps.grid.centre_line import CentreLine
from racecar.maps.whole_files import write_atomically

HEADER = "# x_m,y_m,w_tr_right_m,w_tr_left_m"
"""The columns, by definition of TUMFTM's global_racetrajectory_optimization, which takes the last point to be
followed by the first one."""


def save_track_csv(line: CentreLine, path: Path) -> None:
    """Write a line per point of the centre line. Raises UserError when the place cannot be written to."""
    rows = np.column_stack([line.points, line.right, line.left])
    text = "".join(",".join(f"{value:.4f}" for value in row) + "\n" for row in rows)
    with write_atomically(path) as partial:
        partial.write_text(f"{HEADER}\n{text}", encoding="ascii")
