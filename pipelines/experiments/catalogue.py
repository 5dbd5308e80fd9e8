"""All experiments, in the order of a report.

A new experiment is a module of this package, with a function of the module's name that is an `Experiment`,
and an entry here, from which ``racecar experiment`` makes its command. The modules are imported when they
run, since they draw with matplotlib, which would delay every ``--help``.
"""

from dataclasses import dataclass
from enum import Flag, auto
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from racecar.pipelines.experiments.experiment import Experiment


class Uses(Flag):
    """Inputs of an experiment, and so options of its command."""

    NOTHING = 0
    SETTINGS = auto()
    """The localizer's settings and a seed."""
    REPETITIONS = auto()
    """Many runs, whose number can be reduced or which can be spread over a cluster."""
    RECORDING = auto()
    """A required recording."""
    EXTRA_RECORDING = auto()
    """An optional recording, with its start pose."""
    END_POSE = auto()
    """The pose at the end of the recording, by tape measure."""


@dataclass(frozen=True)
class ExperimentEntry:
    """The description of an experiment, available without importing it."""

    name: str
    """Name of the command; with underscores, of the module and its function."""
    uses: Uses
    help: str
    """A sentence."""
    example: str
    """Arguments of the command."""

    def load(self) -> "Experiment":
        """Import the experiment."""
        name = self.name.replace("-", "_")
        experiment: Experiment = getattr(import_module(f"{__package__}.{name}"), name)
        return experiment


CATALOGUE = (
    ExperimentEntry(
        "sensor-model",
        Uses.NOTHING,
        "Pictures of the sensor table: as a surface, and a slice with its parts.",
        "--out runs/pictures",
    ),
    ExperimentEntry(
        "motion-model",
        Uses.SETTINGS,
        "A picture of what odometry noise does to the particles.",
        "--out runs/pictures",
    ),
    ExperimentEntry(
        "noise-sweep",
        Uses.SETTINGS | Uses.REPETITIONS,
        "How much motion noise to assume: the car is moved from (0, 0, 0) to (1, 1, 0).",
        "--out runs/noise",
    ),
    ExperimentEntry(
        "convergence",
        Uses.SETTINGS | Uses.REPETITIONS | Uses.EXTRA_RECORDING,
        "How fast a cloud of 0.5 m collapses about the car; with --bag and --map on a recording too.",
        "--out runs/convergence --bag drive.bag --map runs/drive",
    ),
    ExperimentEntry(
        "autograde",
        Uses.SETTINGS | Uses.REPETITIONS,
        "The deviation from the truth, compared with that of the course's filter, and the grades.",
        "--out runs/grades",
    ),
    ExperimentEntry(
        "beams-and-particles",
        Uses.SETTINGS | Uses.REPETITIONS,
        "Accuracy and time per update over numbers of beams and particles.",
        "--out runs/beams",
    ),
    ExperimentEntry(
        "real-run",
        Uses.SETTINGS | Uses.RECORDING | Uses.END_POSE,
        "What a drive without truth shows: scans on walls, particles, latency, the end pose.",
        "drive.bag --map runs/drive --end-pose '3.2 -0.5' --out runs/real",
    ),
)
