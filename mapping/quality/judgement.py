"""The verdict: what the statistics of a finished map say of its error.

The model was learned from maps of known error: see `pytest -m slow` and the notes in `_MODEL`.
"""

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.doubtful_segments import doubtful_segments
from racecar.mapping.quality.error_model import ErrorModel, Term
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.quality.statistics import measure

_MODEL = ErrorModel(
    local=0.015,
    whole=0.03,
    terms=(
        Term(
            "spread_local",
            0.003,
            1.0,
            0.01,
            0.7,
            0.7,
            "by its residuals, the pose graph leaves {:.2f} m open per 10 m",
        ),
        Term(
            "excess_through",
            0.005,
            0.5,
            0.01,
            0.5,
            0.5,
            "passes look through {:.0%} more of each other's walls than neighbours do",
        ),
        Term(
            "residual_scan_matching",
            0.003,
            0.3,
            0.008,
            0.7,
            0.7,
            "scan matches end {:.3f} m off the solution",
        ),
        Term(
            "walls_apart_passes_mean",
            0.003,
            0.5,
            0.006,
            0.3,
            0.3,
            "walls of different passes lie {:.2f} m apart",
        ),
        Term("wheels_metres_mean", 0.02, 1.5, 0.05, 0.3, 0.3, "wheels and map differ by {:.2f} m per 2 m"),
    ),
)


def judge(map_: FinishedMap, config: QualityConfig) -> MapQuality:
    """The verdict on a finished map."""
    if len(map_.poses) < 2 or map_.path[-1] < config.least_path:
        # What was seen from one place cannot contradict itself.
        return MapQuality(Verdict.GOOD, 0.0, 0.0, (), (), {})
    statistics = measure(map_, config)
    local, whole = _MODEL.errors(statistics.figures)
    verdict = _verdict(local, whole, config)
    if verdict == Verdict.GOOD:
        return MapQuality(verdict, local, whole, (), (), statistics.figures)
    segments = doubtful_segments(map_, statistics, config.segments)
    complaints = _MODEL.complaints(statistics.figures, config.complaint_factor)
    reasons = (*(f"{text[0].upper()}{text[1:]}." for text in complaints), *(each.why for each in segments))
    return MapQuality(verdict, local, whole, reasons, segments, statistics.figures)


def _verdict(local: float, whole: float, config: QualityConfig) -> Verdict:
    """By how far the errors that are expected, ``local`` per 10 m and of the ``whole``, exceed what a good
    map may err; the worse counts."""
    excess = max(local / config.good_local, whole / config.good_whole)
    if excess <= 1.0:
        return Verdict.GOOD
    return Verdict.WRONG if excess > config.wrong_factor else Verdict.DOUBTFUL
