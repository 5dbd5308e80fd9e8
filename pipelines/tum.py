"""Trajectories as TUM files: ``t x y z qx qy qz qw`` per line, seconds and metres."""

from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from maps.errors import UserError
from maps.trajectory import Trajectory
from pipelines.outputs import write_atomically
from pipelines.text_file import read_text

_COLUMNS = 8
_LATEST_SECONDS = 2**63 // 10**9


def save_tum(trajectory: Trajectory, path: Path) -> None:
    """Write poses as TUM; stamps keep every nanosecond.

    Raises UserError when the place cannot be written to.
    """
    with write_atomically(path) as partial, partial.open("w", encoding="ascii") as file:
        for stamp, (x, y, yaw) in zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True):
            seconds, nanoseconds = divmod(stamp, 10**9)
            qz, qw = np.sin(yaw / 2), np.cos(yaw / 2)
            file.write(f"{seconds}.{nanoseconds:09d} {x:.9f} {y:.9f} 0 0 0 {qz:.12f} {qw:.12f}\n")


def load_tum(path: Path) -> Trajectory:
    """Read a TUM file; of poses in space, x, y and the yaw are taken.

    Raises UserError that names the line when the file is not a TUM trajectory in ascending time.
    """
    stamps: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        stamp, row = _parse_line(line, f"line {number} of {path}")
        if stamps and stamp <= stamps[-1]:
            raise UserError(
                f"The time of line {number} of {path} is not after the one before; sort the file."
            )
        stamps.append(stamp)
        rows.append(row)
    if not stamps:
        raise UserError(f"{path} holds no poses; it should hold lines 't x y z qx qy qz qw'.")
    x, y, _, qx, qy, qz, qw = np.array(rows).T
    yaw = np.arctan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
    return Trajectory(np.array(stamps, dtype=np.int64), np.column_stack([x, y, yaw]))


def _parse_line(line: str, place: str) -> tuple[int, list[float]]:
    fields = line.split()
    if len(fields) != _COLUMNS:
        raise UserError(
            f"There are {len(fields)} numbers in {place}; a TUM line has {_COLUMNS}: 't x y z qx qy qz qw'."
        )
    try:
        seconds = Decimal(fields[0])
        row = [float(field) for field in fields[1:]]
        if not abs(seconds) < _LATEST_SECONDS:
            raise ValueError
    except (InvalidOperation, ValueError) as error:
        raise UserError(
            f"There is something that is not a valid number in {place}: '{line.strip()}'."
        ) from error
    if not np.all(np.isfinite(row)) or not 0 < np.linalg.norm(row[3:]) < np.inf:
        raise UserError(f"There is no valid pose in {place}: '{line.strip()}'.")
    return int((seconds * 10**9).to_integral_value()), row
