"""What each part of mapping is good for: the same logs with one part left out."""

from collections.abc import Callable, Mapping, Sequence

from racecar.mapping.config import MappingConfig
from racecar.pipelines.benchmarks.slam.log_benchmark import LogFigures, measure_all
from racecar.pipelines.benchmarks.slam.logs import BenchmarkLog

_LEFT_OUT = {
    "without refinement": {"refine": False},
    "without loop closure": {"close_loops": False},
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
    for name, changes in _LEFT_OUT.items():
        announce(f"{name.capitalize()}:")
        changed = settings.model_copy(update=changes)
        variants[name] = measure_all(logs, changed, announce=announce, quiet=quiet)
    return variants
