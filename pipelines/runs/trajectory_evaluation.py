"""Compare trajectories with a reference: the tables and plots of ``racecar evaluate``."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.pose_topics import load_pose_topic, pose_topics
from racecar.pipelines.files.pose_csv import load_pose_csv
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.evaluation.evaluation import TrajectoryErrors, compare

_BAG_SUFFIXES = (".bag", ".db3", ".mcap")
_ENOUGH = 0.9
"""Minimum share of the poses that the reference should cover. A drive that ends early, or a tracker that
loses the car in the corners, would otherwise look better than it is."""


@dataclass(frozen=True, eq=False)
class NamedTrajectory:
    """A trajectory and its source."""

    name: Path
    """As the user gave it."""
    file: Path
    """The file or bag folder that holds it."""
    trajectory: Trajectory
    warnings: list[str] = field(default_factory=list)
    """Sentences for people."""


@dataclass(frozen=True, eq=False)
class Evaluated:
    """A trajectory and its errors."""

    estimated: NamedTrajectory
    errors: TrajectoryErrors

    @property
    def path(self) -> Path:
        """The trajectory's path, as the user gave it."""
        return self.estimated.name

    @property
    def warnings(self) -> list[str]:
        """Sentences for people."""
        share = self.errors.matched / self.errors.total
        if share >= _ENOUGH:
            return self.estimated.warnings
        return [
            *self.estimated.warnings,
            f"The reference covers only {share:.0%} of the poses of {self.path}: the errors of the others "
            "are not known and may be larger.",
        ]


def load_trajectory(name: Path) -> NamedTrajectory:
    """Read ``FILE.tum``, ``FILE.csv`` or ``BAG:/topic``. Raises UserError that explains a fault."""
    bag, colon, topic = str(name).rpartition(":")
    if colon and not name.exists():
        trajectory, findings = load_pose_topic(Path(bag), topic)
        return NamedTrajectory(
            name, Path(bag), trajectory, [f"{name}: {finding.sentence}" for finding in findings]
        )
    if name.is_dir() or name.suffix.lower() in _BAG_SUFFIXES:
        topics = pose_topics(name)
        if not topics:
            raise UserError(f"The bag {name} has no topic of poses: give a TUM or CSV file, or another bag.")
        raise UserError(
            f"Which poses of the bag are meant? Name their topic, as in {name}:{topics[0]}; "
            f"its topics of poses: {', '.join(topics)}."
        )
    load = load_pose_csv if name.suffix.lower() == ".csv" else load_tum
    return NamedTrajectory(name, name, load(name))


def evaluate_all(names: Sequence[Path], reference: NamedTrajectory) -> list[Evaluated]:
    """Errors of each trajectory. Raises UserError that names the faulty one."""
    estimated, evaluated = [load_trajectory(name) for name in names], []
    for each in estimated:
        try:
            evaluated.append(Evaluated(each, compare(each.trajectory, reference.trajectory)))
        except UserError as error:
            raise (UserError(f"{each.name}: {error}") if len(names) > 1 else error) from error
    return evaluated


def plot_errors(evaluated: Sequence[Evaluated], map_path: Path | None, picture: Path) -> None:
    """Draw errors along the paths, on one map or on the maps beside the trajectories, and over time.

    Raises UserError when a given map cannot be read, or the picture cannot be written.
    """
    from racecar.pipelines.files.pictures.figure_files import DOTS_PER_INCH, save_figure
    from racecar.pipelines.runs.evaluation.error_picture import MeasuredPath, error_picture

    given = None if map_path is None else load_map(map_path)
    paths = [
        MeasuredPath(str(each.path), each.errors, given or _map_of(each.estimated.file)) for each in evaluated
    ]
    save_figure(picture, error_picture(paths), DOTS_PER_INCH, "racecar evaluate")


def _map_of(trajectory: Path) -> OccupancyGrid | None:
    """The map beside a trajectory or bag, or the one named in its report."""
    try:
        return load_map(trajectory.parent / "map.yaml")
    except UserError:
        return read_report(trajectory.parent).named_map()
