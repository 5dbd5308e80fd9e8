"""The settings of keyframes: how they are placed and tied, what is trimmed of them, and how other scans
follow.

Where a description says "prototype", the value comes from a throw-away program that mapped the logs aces,
fr079 and intel with it before this mapper was written; it was chosen on these logs.
"""

import math
from typing import Annotated

from pydantic import AfterValidator, Field

from racecar.maps.settings import Settings


def _with_the_one_before(backs: tuple[int, ...]) -> tuple[int, ...]:
    if 1 not in backs:
        raise ValueError("1 must be among them, for the second keyframe has only one before it")
    return backs


KeyframesBack = Annotated[
    tuple[Annotated[int, Field(ge=1, le=1000)], ...], AfterValidator(_with_the_one_before)
]
"""Keyframes counted back along the path; up to 1000, because no match reaches farther than some tens."""


class GuessConfig(Settings):
    """When two guesses are one."""

    same_guess_distance: float = Field(
        default=0.1,
        gt=0.0,
        le=2.0,
        description="Metres between two guesses within which matching leads to the same place. By judgement: "
        "less than the distance within which partners are looked for in the end.",
    )
    same_guess_angle: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        description="Radians between two guesses, the same. By judgement.",
    )


class MotionPriorConfig(Settings):
    """How often each guess of a motion is right."""

    first_share: float = Field(
        default=0.95,
        gt=0.0,
        lt=1.0,
        description="How often the first guess, which is the wheels' where there are any, is right, as a "
        "share of this and `other_share` for each further guess. By judgement.",
    )
    other_share: float = Field(
        default=0.005,
        gt=0.0,
        lt=1.0,
        description="The same of each further guess, and of the first where wheels repeat one pose to the "
        "last bit, as a driver that hangs does. By judgement: along an arc or a bare corridor scans fit "
        "nearly everywhere.",
    )
    none_share: float = Field(
        default=0.003,
        gt=0.0,
        lt=1.0,
        description="How often none of the guesses is right. By judgement: wheels slip or report nonsense.",
    )
    carried_share: float = Field(
        default=0.3,
        gt=0.0,
        lt=1.0,
        description="The same after a gap in which the car stood, for it may have been moved by hand. By "
        "judgement.",
    )


class ScanEvidenceConfig(Settings):
    """What scans say of a place where a keyframe may lie."""

    min_judged: float = Field(
        default=0.2,
        gt=0.0,
        le=1.0,
        description="Share of the points that must be judged for their word to count in full. By judgement.",
    )
    min_matched: float = Field(
        default=0.03,
        gt=0.0,
        le=1.0,
        description="Share of the points that must be matched for their fit to count in full. By judgement: "
        "where the car drove on while scans were missing, little of what it saw before is seen again. With "
        "0.2, one that drove 15 m of a bare corridor was put back to where it had been.",
    )
    unlike_share: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="Share of the points that may lie either way whatever is true: people, glass, edges. By "
        "judgement.",
    )
    by_agreement: float = Field(
        default=15.0,
        ge=0.0,
        le=10000.0,
        description="Log-odds for a place, per unit of the log-odds that a judged point lies on a surface "
        "and is not looked through. Points are not independent, else it would be hundreds: fitted to 3100 "
        "keyframes of aces and fr079 with scans left out, 10 to 15 tell right places from wrong ones best.",
    )
    by_fit: float = Field(
        default=20.0,
        ge=0.0,
        le=10000.0,
        description="Log-odds for a place where all matched points lie on lines, and against one where none "
        "does. Fitted likewise: 10 to 20.",
    )


class PlacementConfig(GuessConfig):
    """Where a new keyframe lies among those before it."""

    placed_against: KeyframesBack = Field(
        default=(1, 2, 4, 7, 11),
        min_length=1,
        description="With which keyframes, counted back along the path, a new one is matched jointly. By "
        "judgement: the first of those that it is tied to, which surely overlap.",
    )
    min_overlap: float = Field(
        default=0.1,
        ge=0.0,
        le=1.0,
        description="Share of points with a partner, summed over the scans that a keyframe is matched with, "
        "below which no scan shows a place where scans came all the time; it then loses against the first "
        "guess. By judgement: without it, simulated drives over a slope were off by 0.39 and 0.56 m instead "
        "of 0.04 and 0.07 m.",
    )
    max_residual: float = Field(
        default=0.02,
        gt=0.0,
        le=1.0,
        description="Metres, weighted root mean square distance to the lines, above which the scans came to "
        "lie across one another, as after a fast turn. Measured with `racecar map --no-odom`: judging by it "
        "and not by overlap alone took aces from 0.109 to 0.068 m, fr079 from 2.68 to 0.044 m, intel from "
        "0.231 to 0.025 m.",
    )
    prior: MotionPriorConfig = MotionPriorConfig()
    evidence: ScanEvidenceConfig = ScanEvidenceConfig()
    refuted_odds: float = Field(
        default=5.0,
        ge=0.0,
        le=10000.0,
        description="Log-odds of another place over the one to which the first guess leads, from which on "
        "the scans refute what wheels say of the step. By judgement.",
    )
    lost_odds: float = Field(
        default=-15.0,
        ge=-10000.0,
        le=0.0,
        description="Log-odds of the likeliest place below which the keyframe is lost. By judgement: on aces "
        "with a scan every two seconds true places had -11 and more, wrong ones -22 and less.",
    )
    lost_overlap: float = Field(
        default=0.2,
        ge=0.0,
        le=1.0,
        description="Share of points with a partner from the best guess, below which the keyframe is lost "
        "and searched for in wide windows. By judgement.",
    )
    searched_among: int = Field(
        default=20,
        ge=1,
        le=500,
        description="Keyframes before a lost one, among which it is placed. By judgement: some 6 m of path.",
    )
    search_reach: float = Field(
        default=1.5,
        gt=0.0,
        le=20.0,
        description="Metres to each side that a lost keyframe is searched for. On session_A the car was "
        "carried a metre while nothing was recorded; the margin is by judgement.",
    )
    search_turn: float = Field(
        default=math.radians(45.0),
        gt=0.0,
        le=math.pi,
        description="Radians to each side, the same. By judgement.",
    )
    search_radius: float = Field(
        default=20.0,
        gt=0.0,
        le=200.0,
        description="Metres from the laser, beyond which points do not take part in the search: farther, "
        "beams lie too wide apart. By judgement.",
    )
    search_score: float = Field(
        default=0.4,
        gt=0.0,
        le=1.0,
        description="Mean likelihood of the points that a place found by the search has at least. By "
        "judgement.",
    )
    min_search_points: int = Field(
        default=30,
        ge=1,
        le=1000,
        description="Points of a scan below which there is no search, for few fit anywhere. By judgement.",
    )


class ConstraintConfig(Settings):
    """Which keyframes are tied together by scan matching."""

    tied_to: KeyframesBack = Field(
        default=(1, 2, 4, 7, 11, 16, 22, 30),
        min_length=1,
        description="To which keyframes, counted back along the path, each is tied. Prototype: before any "
        "loop is closed, wide spacing halves the drift compared with the last eight.",
    )
    initial_distance: float = Field(
        default=0.3,
        gt=0.0,
        le=5.0,
        description="Metres within which partners are looked for at first: both keyframes have been placed. "
        "By judgement.",
    )
    min_overlap: float = Field(
        default=0.06,
        ge=0.0,
        le=1.0,
        description="Share of points with a partner that a match must have to count. What few points tell is "
        "in the information of the match: on a simulated campus, where a third of the keyframes share less "
        "than 0.15, such matches err by as many of their standard deviations as the others, and down to 0.03 "
        "take the mean error from 0.086 to 0.024 m (racecar benchmark worlds). Where a race car's wheels "
        "know no turns, 0.05 and less once led 4 degrees astray (test_gyroscope).",
    )
    max_residual: float = Field(
        default=0.04,
        gt=0.0,
        le=1.0,
        description="Metres, weighted root mean square distance to the lines that a match may have to "
        "count. By judgement: as much as a straight surface may be off straight.",
    )


class GapConfig(Settings):
    """What to make of a time without scans."""

    after_driving: float = Field(
        default=0.5,
        gt=0.0,
        le=60.0,
        description="Seconds without a scan, after which a car that drove, as its wheels say, is placed "
        "where they put it. On a simulated ring, one or two seconds ended in a map turned by a quarter; "
        "half a second is by judgement.",
    )
    after_standing: float = Field(
        default=2.0,
        gt=0.0,
        le=600.0,
        description="Seconds without a scan, after which a car that stood may have been moved by hand. By "
        "judgement.",
    )
    driven_keyframes: float = Field(
        default=2.0,
        ge=0.0,
        le=100.0,
        description="By what factor the distance since the last keyframe must exceed `keyframe_distance` for "
        "the car to have driven. By judgement: two keyframes in a row are never so far apart.",
    )


class RevisitConfig(Settings):
    """Places that the car passes more than once: ties to the first pass, and what is known well enough."""

    same_pass: int = Field(
        default=39,
        ge=1,
        le=10_000,
        description="Keyframes along the path, over fewer of which two belong to one pass and are tied "
        "anyway. By judgement: a little over the farthest that is tied back along the path.",
    )
    reach: float = Field(
        default=2.0,
        gt=0.0,
        le=50.0,
        description="Metres within which keyframes of two passes are near each other. By judgement: the "
        "width of a corridor.",
    )
    max_turn: float = Field(
        default=1.0,
        gt=0.0,
        le=math.pi,
        description="Radians within which they face alike, so that they see the same. By judgement: lasers "
        "of 270 degrees then share three quarters of their view.",
    )
    every: int = Field(
        default=3,
        ge=1,
        le=100,
        description="Of so many keyframes one is tied to the first pass. By judgement: their scans overlap "
        "for metres, and the graph stays small.",
    )
    ties: int = Field(
        default=2,
        ge=1,
        le=100,
        description="Keyframes of the first pass to which one is tied at most. By judgement.",
    )
    outdated_after: int = Field(
        default=2,
        ge=1,
        le=1_000_000,
        description="Later drives near a keyframe, from which on what it saw is forgotten. By judgement: one "
        "could be misled by people, two show what stays.",
    )
    known_after: int = Field(
        default=6,
        ge=1,
        le=1000,
        description="Keyframes of earlier passes near a place, from which on it is known well enough. By "
        "judgement: as many as one pass leaves there.",
    )
    max_spread: float = Field(
        default=0.1,
        gt=0.0,
        le=1000.0,
        description="Metres of standard deviation between two passes, up to which matches and loop closures "
        "tie them surely; beyond, they may only seem to meet. By judgement: a little more than where loops "
        "are looked for.",
    )
    min_coverage: float = Field(
        default=0.6,
        ge=0.0,
        le=1.0,
        description="Share of what two scans see that lies on what the other sees, for one to stand for the "
        "other; from behind a wall little does. By judgement.",
    )


class MisledConfig(Settings):
    """When a contradiction between wheels and scan matches is blamed on the scans."""

    most_sigmas: float = Field(
        default=3.0,
        gt=0.0,
        le=100.0,
        description="Standard deviations by which a match may differ from the wheels. By judgement.",
    )
    least_sigma: float = Field(
        default=0.0005,
        gt=0.0,
        le=1.0,
        description="Least of these, metres and radians: what a good match errs by. Measured in simulation: "
        "0.0005 to 0.001 rad, 0.005 m.",
    )
    min_matches: int = Field(
        default=20,
        ge=1,
        le=100000,
        description="Matches below which their spread is not known. By judgement.",
    )
    min_contradicted: float = Field(
        default=0.33,
        ge=0.0,
        le=1.0,
        description="Share of the matches over a step that the wheels must contradict. By judgement: ground "
        "in view misleads now those over few steps, now those over many.",
    )
    most_sigmas_open: float = Field(
        default=1.5,
        gt=0.0,
        le=100.0,
        description="Standard deviations, by what the matches claim, up to which a cycle counts as closed. "
        "Measured: nine of ten are where scans are not misled, since matches of the same scans err alike.",
    )
    times_usual: float = Field(
        default=2.5,
        ge=1.0,
        le=100.0,
        description="Times the median of cycles over as many steps up to which one counts as closed: some "
        "matches claim too much. Measured: on fr079 the median is 1.8 standard deviations over 30 steps.",
    )
    presumed_closed: float = Field(
        default=20.0,
        ge=0.0,
        le=10000.0,
        description="Cycles over a stretch that are presumed to be there and closed, so that a few open ones "
        "prove nothing. By judgement.",
    )
    min_closed: float = Field(
        default=0.6,
        gt=0.0,
        le=1.0,
        description="Share of the cycles over a stretch that are closed where scans are not misled, if they "
        "fit as well as usual. Measured: 0.7 and more where wheels slip or know no turns, on hilly campuses "
        "mostly 0.3 to 0.6.",
    )
    usual_fit: float = Field(
        default=1.1,
        ge=1.0,
        le=100.0,
        description="By what factor scans may fit worse over a stretch than elsewhere without meaning. "
        "Measured: 1.0 to 1.1 on a track and in an office, 1.2 to 1.7 on hilly campuses. By judgement the "
        "fourth power of what is beyond weighs as much as open cycles do.",
    )


class TrimmingConfig(Settings):
    """What a drive of hours forgets, so that its memory grows with the places and not with the time."""

    keyframes: int = Field(
        default=1500,
        ge=1,
        le=1000000,
        description="Keyframes up to which none is trimmed, since each pass through a place makes the map a "
        "little truer. By judgement: some 450 m of path.",
    )
    scans: int = Field(
        default=6000,
        ge=0,
        le=1000000,
        description="Scans between keyframes, at most, that wait for the end of the drive to find their "
        "places; each keyframe takes the room of two. Placed on the way, among keyframes that are as good "
        "as final, they lie some tenths of a millimetre worse: aces, fr079 and intel were 0.0344, 0.0399 "
        "and 0.0134 m instead of 0.0344, 0.0399 and 0.0133 m.",
    )
    scans_per_keyframe: int = Field(
        default=200,
        ge=1,
        le=100_000,
        description="Scans after a keyframe, from which on the car stands and further ones show nothing "
        "new. By judgement: five seconds of a fast laser.",
    )
    delay: int = Field(
        default=200,
        ge=0,
        le=100000,
        description="Keyframes after which one may be trimmed: by then its loops are closed. By judgement: "
        "some 60 m of path, as far as loop closures wait for consistent support.",
    )


class ScanRefinementConfig(GuessConfig):
    """How scans between keyframes find their places among these."""

    clearly_better: float = Field(
        default=1.25,
        ge=1.0,
        le=10.0,
        description="By what factor scans must fit better from another guess until it wins. By judgement: "
        "along an arc or a bare corridor they fit nearly everywhere, and best where the car did not move at "
        "all.",
    )
    near_in_time: tuple[Annotated[int, Field(ge=-1000, le=1000)], ...] = Field(
        default=(-3, -2, -1, 0, 1, 2, 3, 4),
        min_length=1,
        description="Keyframes with which a scan is matched, counted from the one it follows. Prototype: "
        "eight.",
    )
    near_in_space: int = Field(
        default=6,
        ge=0,
        le=100,
        description="Keyframes of other passes with which it is matched, the nearest. Prototype: with these, "
        "intel fell from 0.033 to 0.012 m, fr079 from 0.063 to 0.042 m.",
    )
    other_pass: int = Field(
        default=6,
        ge=0,
        le=10_000,
        description="Keyframes along the path, beyond which one counts as near in space and not in time. By "
        "judgement.",
    )
    spatial_candidates: int = Field(
        default=30,
        ge=1,
        le=10_000,
        description="Keyframes about a scan, the nearest, among which those of other passes are looked for. "
        "By judgement.",
    )
    max_turn: float = Field(
        default=1.0,
        gt=0.0,
        le=math.pi,
        description="Radians within which they face alike. By judgement, as of keyframes of two passes.",
    )
    initial_distance: float = Field(
        default=0.3,
        gt=0.0,
        le=5.0,
        description="Metres within which partners are looked for at first. By judgement: between two "
        "keyframes dead reckoning misses less.",
    )
    kernel_width: float = Field(
        default=0.08,
        gt=0.0,
        le=1.0,
        description="Metres off its line at which a point weighs a quarter. By judgement: twice as much as "
        "between keyframes, whose guesses are better.",
    )
    prior_position: float = Field(
        default=5.0,
        ge=0.0,
        le=1000.0,
        description="What the guess of a position counts for along each axis, in points on a wall. By "
        "judgement: along a bare corridor it decides, elsewhere some hundred points do.",
    )
    prior_heading: float = Field(
        default=20.0,
        ge=0.0,
        le=10000.0,
        description="What the guess of a heading counts for, in points a metre away. By judgement.",
    )
    poor_share: float = Field(
        default=0.7,
        ge=0.0,
        le=1.0,
        description="Share of the usual overlap below which a scan fits poorly and is tried again from where "
        "its neighbours lie. By judgement.",
    )
    usual_among: int = Field(
        default=101,
        ge=1,
        le=100_001,
        description="Scans about one, over which the usual overlap is the median; odd. By judgement: some "
        "seconds of driving.",
    )


class KeyframeConfig(Settings):
    """How keyframes are placed and tied together."""

    placement: PlacementConfig = PlacementConfig()
    constraints: ConstraintConfig = ConstraintConfig()
    gaps: GapConfig = GapConfig()
    revisits: RevisitConfig = RevisitConfig()
    misled: MisledConfig = MisledConfig()
    trimming: TrimmingConfig = TrimmingConfig()
    refinement: ScanRefinementConfig = ScanRefinementConfig()
