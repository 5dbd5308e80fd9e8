"""The verdict: what the statistics of a finished map say of its error."""

from collections.abc import Iterator, Mapping

import numpy as np

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.doubtful_segments import doubtful_segments
from racecar.mapping.quality.earlier_drives import MOST_UNLIKE, unlike_earlier
from racecar.mapping.quality.error_model import NOTHING, ErrorModel, Power, Term
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.jumps import MOST_JUMP
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.quality.statistics import measure
from racecar.mapping.quality.unseen_stands import MOST_UNSEEN_WAY
from racecar.mapping.quality.wheel_agreement import MOST_DENIED

_MODEL = ErrorModel(
    local=0.02,
    whole=0.083,
    terms=(
        Term(
            "spread_per_10_m",
            least=0.003,
            most=3.0,
            usual=0.014,
            local=Power(0.0083, 1.1),
            whole=NOTHING,
            complaint="What ties the path together leaves {:.2f} m per 10 m open, by its residuals.",
        ),
        Term(
            "spread_of_whole",
            least=0.005,
            most=5.0,
            usual=0.014,
            local=NOTHING,
            whole=Power(0.0093, 1.1),
            complaint="What ties the map together leaves {:.2f} m from one end to the other open.",
        ),
        Term(
            "match_residual_m",
            least=0.001,
            most=0.1,
            usual=0.01,
            local=Power(0.0029, 2.0),
            whole=Power(0.00051, 3.0),
            complaint="Scans fit each other elsewhere than the map has them, by {:.3f} m on average.",
        ),
        Term(
            "looked_through_by_passes",
            least=0.01,
            most=1.0,
            usual=0.01,
            local=Power(0.0013, 1.4),
            whole=Power(0.0011, 1.6),
            complaint="Passes through the same place look through {:.0%} more of what the other one saw than "
            "scans that follow each other.",
        ),
        Term(
            "bare_without_wheels",
            least=0.02,
            most=0.15,
            usual=0.02,
            local=Power(0.0022, 2.4),
            whole=Power(0.0018, 3.0),
            complaint="On {:.0%} of the steps, or of the time, neither wheels nor walls show how far the car "
            "went.",
        ),
    ),
)
"""Learned from 319 maps of known error, of which 82 were wrong (over 0.3 m between places near each other, or
1.5 m over the whole) and 195 good (below 0.1 and 0.5 m): drives simulated in six worlds, aces, fr079, intel,
a track and eight strangers' recordings, whole or in pieces, as they are and made worse as `racecar benchmark
quality` does. As measured with one source left out at a time, it called 5 of the wrong maps good and 4 of the
good ones wrong, 20 % of all doubtful; of the 67 drives as they were recorded, 3 of 63 good maps doubtful and
none wrong. The error near by was within a factor of two for 72 %, of the whole for 67 % (3 and 10 cm and less
being the same, and 1 and 5 m and more). Since then what neighbours look through of each other went: it called
right maps of thin cones and far noisy walls wrong, and of 56 further maps it decided on none. Wheels against
map, distances of walls, the ground between scans and what they see of it, more or other quantiles: none of
these added to it. What is not seen: a map that is wrong everywhere alike, such as mirrored, and drift where
nothing is passed twice."""

_WRONG_FACTOR = 2.5
"""By what factor a map is expected to err more than a good one, from which it is wrong and not only doubtful.
Measured on the maps that the model was learned from."""
_MOST_SCALE = 1.25
"""Factor between lengths by scans and by wheels, from which one of the two must be wrong. By judgement: worn
tyres and wrong settings make some per cent, scans that do not move make any."""
_MOST_OVERRULED = 0.5
"""Share of the steps on which scans may contradict the wheels. By judgement: wheels slip now and then, and a
robot is carried for a while."""
_COMPLAINT_SHARE = 0.25
"""Share of the expected error that a statistic must make up to be given as a reason, so that there are three
at most, beside the floor."""


def judge(map_: FinishedMap, config: QualityConfig) -> MapQuality:
    """The verdict on a finished map: on its last drive, and on how that lies on what earlier ones saw."""
    last = map_.last_drive
    if len(last.poses) < 2:
        # What was seen from one place cannot contradict itself.
        return MapQuality(Verdict.GOOD, _MODEL.local, _MODEL.whole, (), (), {})
    statistics = measure(last)
    figures = statistics.figures
    if last is not map_:
        figures = {**figures, "unlike_earlier": unlike_earlier(map_)}
    by_model, by_slip = _MODEL.errors(figures), (figures["slip_per_10_m"], figures["slip_of_whole"])
    local, whole = np.maximum(by_model, by_slip).tolist()
    verdict = _verdict(local, whole, config)
    doubts = tuple(_doubts(map_.wheel_scale, figures))
    if verdict == Verdict.GOOD and not doubts:
        return MapQuality(verdict, local, whole, (), (), figures)
    found = doubtful_segments(last, statistics)
    segments = tuple(segment.shifted(map_.first_of_last_drive) for segment in found)
    # Passes that contradict each other are named, one by one, with their places.
    named = {"looked_through_by_passes"} if any(s.contradicted_by for s in segments) else set()
    complaints = _MODEL.complaints(figures, _COMPLAINT_SHARE, named) if verdict != Verdict.GOOD else []
    if max(local - by_model[0], whole - by_model[1]) > 0.0 and verdict != Verdict.GOOD:
        complaints.insert(0, _slips(figures))
    reasons = (*doubts, *complaints, *(segment.why for segment in segments))
    verdict = Verdict.DOUBTFUL if verdict == Verdict.GOOD else verdict
    return MapQuality(verdict, local, whole, reasons, segments, figures, doubts)


def _slips(figures: Mapping[str, float]) -> str:
    """What is said of a map whose expected error is that of wheels which slip."""
    return (
        f"Where walls hold, wheels and map differ by {figures['slip_share']:.0%} of the way: where only "
        "wheels show how far the car came, the map is as wrong."
    )


def _doubts(wheel_scale: float, figures: Mapping[str, float]) -> Iterator[str]:
    """What leaves a map doubtful whatever error is expected: scans and wheels that cannot both be right, by
    the scale between them, the share of steps on which wheels were overruled or the way that is denied them;
    a path that jumps, a car that may have been carried unseen, or a drive that may lie elsewhere."""
    unlike = figures.get("unlike_earlier", 0.0)
    if unlike > MOST_UNLIKE:
        yield (
            f"At most places that the drives share, one looks through {unlike:.0%} of what another saw: the "
            "last one was joined at a wrong place, or nearly everything was moved. Look at the map first."
        )
    if max(wheel_scale, 1.0 / max(wheel_scale, 1e-9)) > _MOST_SCALE:
        yield (
            f"By its scans the car drove {wheel_scale:.2f} times as far as by its wheels: one of the two is "
            "wrong."
        )
    elif figures["overruled_wheels"] > _MOST_OVERRULED:
        share = figures["overruled_wheels"]
        yield f"On {share:.0%} of the steps scans and wheels contradict each other: one is wrong."
    if figures["denied_by_map_m"] > MOST_DENIED:
        yield (
            f"Somewhere the wheels drove {figures['denied_by_map_m']:.1f} m that the map denies, and no loop "
            "closure tells which of the two is right: drive through there again."
        )
    if figures["jump_m"] > MOST_JUMP:
        yield (
            f"The path jumps by {figures['jump_m']:.1f} m that the car cannot have driven: one side of the "
            "jump lies at a wrong place, as where places look alike."
        )
    if figures["unseen_way_m"] > MOST_UNSEEN_WAY:
        yield (
            "The car stood between walls that would not show it being carried along them, for as long as it "
            f"usually takes to go {figures['unseen_way_m']:.0f} m: if it was, they are missing in the map."
        )


def _verdict(local: float, whole: float, config: QualityConfig) -> Verdict:
    """By how far the errors that are expected, ``local`` per 10 m and of the ``whole``, exceed what a good
    map may err; the worse counts."""
    excess = max(local / config.good_local, whole / config.good_whole)
    if excess <= 1.0:
        return Verdict.GOOD
    return Verdict.WRONG if excess > _WRONG_FACTOR else Verdict.DOUBTFUL
