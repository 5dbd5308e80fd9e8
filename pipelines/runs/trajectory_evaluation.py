"""Trajectories measured against a reference: what ``racecar evaluate`` tabulates and plots."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.evaluation.evaluation import TrajectoryErrors, compare
from racecar.pipelines.files.report import named_map, read_report
from racecar.pipelines.files.tum import load_tum

_ENOUGH = 0.9
"""Share of the poses that the reference should cover, since a drive that ends early, or a tracker that loses
sight of the car in the corners, would look better than it is."""


@dataclass(frozen=True, eq=False)
class Evaluated:
    """A trajectory and its errors."""

    path: Path
    errors: TrajectoryErrors

    @property
    def warnings(self) -> list[str]:
        """Sentences for people."""
        share = self.errors.matched / self.errors.total
        if share >= _ENOUGH:
            return []
        return [
            f"The reference covers only {share:.0%} of the poses of {self.path}: the errors of the others "
            "are not known and may be larger."
        ]


def evaluate_all(paths: Sequence[Path], reference: Path) -> list[Evaluated]:
    """Errors of each trajectory. Raises UserError that names the file at fault."""
    estimated = [load_tum(path) for path in paths]
    true, evaluated = load_tum(reference), []
    for path, trajectory in zip(paths, estimated, strict=True):
        try:
            evaluated.append(Evaluated(path, compare(trajectory, true)))
        except UserError as error:
            raise (UserError(f"{path}: {error}") if len(paths) > 1 else error) from error
    return evaluated


def plot_errors(evaluated: Sequence[Evaluated], map_path: Path | None, picture: Path) -> None:
    """Draw errors along the paths, on one map or on the maps beside the trajectories, and over time.

    Raises UserError when a map that is given cannot be read, or the picture cannot be written.
    """
    from racecar.pipelines.pictures.error_picture import ERROR_DOTS_PER_INCH, MeasuredPath, error_picture
    from racecar.pipelines.pictures.map_picture import save_figure

    given = None if map_path is None else load_map(map_path)
    paths = [
        MeasuredPath(
            str(each.path),
            each.errors.seconds,
            each.errors.map_from_base,
            each.errors.positions,
            each.errors.headings,
            given or _map_of(each.path),
        )
        for each in evaluated
    ]
    save_figure(picture, error_picture(paths), ERROR_DOTS_PER_INCH)


def _map_of(trajectory: Path) -> OccupancyGrid | None:
    """The map that a run left beside its trajectory, or names in its report."""
    try:
        return load_map(trajectory.parent / "map.yaml")
    except UserError:
        return named_map(read_report(trajectory.parent))
