"""Trajectories that a user names: a TUM file, a CSV file, or a topic of a bag."""

from dataclasses import dataclass, field
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.pose_topics import load_pose_topic, pose_topics
from racecar.pipelines.files.pose_csv import load_pose_csv
from racecar.pipelines.files.tum import load_tum

_BAG_SUFFIXES = (".bag", ".db3", ".mcap")


@dataclass(frozen=True, eq=False)
class NamedTrajectory:
    """A trajectory, and where it was read."""

    name: Path
    """As the user gave it."""
    file: Path
    """The file or bag folder that holds it."""
    trajectory: Trajectory
    warnings: list[str] = field(default_factory=list)
    """Sentences for people."""


def load_trajectory(name: Path) -> NamedTrajectory:
    """Read ``FILE.tum``, ``FILE.csv`` or ``BAG:/topic``. Raises UserError that says what is wrong with it."""
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
