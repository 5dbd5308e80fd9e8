"""What each part of mapping is good for: the same logs with one part left out."""

from collections.abc import Callable, Mapping, Sequence

from benchmarks.slam.log_benchmark import LogFigures, measure_all
from benchmarks.slam.logs import BenchmarkLog
from benchmarks.slam.parts import PARTS
from racecar.mapping.config import MappingConfig

_SWITCHED_OFF = {
    "refinement": {"refine": False},
    "loop closure": {"close_loops": False},
}


def ablate(
    logs: Sequence[BenchmarkLog],
    settings: MappingConfig,
    default: Mapping[str, LogFigures],
    *,
    announce: Callable[[str], None],
    quiet: bool,
) -> dict[str, Mapping[str, LogFigures]]:
    """The figures of every log by variant, beginning with those of the whole, which are given."""
    announce("Without wheel odometry:")
    without_odometry = measure_all(logs, settings, use_odometry=False, announce=announce, quiet=quiet)
    variants = {"default": default, "without wheel odometry": without_odometry}
    for name, changes in _SWITCHED_OFF.items():
        announce(f"Without {name}:")
        changed = settings.model_copy(update=changes)
        variants[f"without {name}"] = measure_all(logs, changed, announce=announce, quiet=quiet)
    for name in PARTS:
        announce(f"Without {name}:")
        figures = measure_all(logs, settings, left_out=name, announce=announce, quiet=quiet)
        variants[f"without {name}"] = figures
    return variants
