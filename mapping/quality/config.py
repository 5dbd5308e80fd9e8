"""Settings of the verdict on a map."""

from pydantic import Field

from racecar.maps.settings import Settings


class PassAgreementConfig(Settings):
    """Which scans are compared, and how."""

    reach: float = Field(
        default=4.0,
        gt=0.0,
        le=100.0,
        description="Metres within which two keyframes see much of the same. Measured on 133 maps of known "
        "error, see `racecar.mapping.quality.judgement`.",
    )
    apart: float = Field(
        default=3.0,
        gt=0.0,
        le=1000.0,
        description="Metres of path, beyond which two keyframes belong to different passes. Likewise.",
    )
    neighbours: float = Field(
        default=1.5,
        gt=0.0,
        le=100.0,
        description="Metres of path within which two keyframes are neighbours. By judgement: drift is "
        "millimetres over it.",
    )
    max_keyframes: int = Field(
        default=1500,
        ge=2,
        le=1_000_000,
        description="Keyframes that are compared at most, for time and memory. By judgement: every metre of "
        "a path of a kilometre and a half.",
    )
    max_pairs: int = Field(
        default=1200, ge=1, le=1_000_000, description="Pairs of passes, for the time it takes. By judgement."
    )
    max_neighbours: int = Field(
        default=300, ge=1, le=1_000_000, description="Pairs of neighbours, likewise. By judgement."
    )
    match_reach: float = Field(
        default=2.0,
        gt=0.0,
        le=100.0,
        description="Metres within which two keyframes are matched anew. By judgement: the width of a "
        "corridor, as where passes are tied.",
    )
    match_turn: float = Field(
        default=1.0,
        gt=0.0,
        le=4.0,
        description="Radians within which they face alike. By judgement, likewise.",
    )
    match_distance: float = Field(
        default=0.6,
        gt=0.0,
        le=10.0,
        description="Metres within which a wall of the other pass is sought: twice as far as where the graph "
        "is built, because a wrong map may lie beyond that.",
    )
    min_overlap: float = Field(
        default=0.3,
        gt=0.0,
        le=1.0,
        description="Share of points that must find a partner. By judgement: of fewer, chance has its part.",
    )


class DoubtfulSegmentConfig(Settings):
    """When a part of the path is named."""

    most_of_a_kind: int = Field(
        default=3, ge=1, le=1000, description="Segments that are named of each kind at most. By judgement."
    )
    length: float = Field(
        default=5.0,
        gt=0.0,
        le=1000.0,
        description="Metres of path that count as one place. By judgement: about what one scan sees well.",
    )
    min_judged: int = Field(
        default=200,
        ge=1,
        le=1_000_000,
        description="Returns that must be judged before two passes can contradict each other. By judgement.",
    )
    min_share: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        description="Share looked through, beyond what neighbours look through of each other, from which two "
        "passes contradict each other. By judgement.",
    )
    min_apart: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Metres from which walls, or wheels and map, are said to differ: two cells of the map.",
    )
    surprising: float = Field(
        default=4.0,
        ge=1.0,
        le=1000.0,
        description="By what factor a window must exceed the usual difference of wheels and map to be named. "
        "By judgement.",
    )
    min_slack: float = Field(
        default=0.15,
        gt=0.0,
        le=100.0,
        description="Metres of standard deviation from which a step counts as not tied by scans: three cells "
        "of the map.",
    )


class QualityConfig(Settings):
    """How a finished map is looked back at."""

    passes: PassAgreementConfig = PassAgreementConfig()
    segments: DoubtfulSegmentConfig = DoubtfulSegmentConfig()
    local_distance: float = Field(
        default=10.0,
        gt=0.0,
        le=1000.0,
        description="Metres of path over which the local error is stated, by definition.",
    )
    max_groups: int = Field(
        default=600,
        ge=2,
        le=10_000,
        description="Groups in which the keyframes of a long drive move while their spreads are computed: "
        "time grows with the third power, memory with the second. Measured on aces and fr079: with 600 the "
        "spread per 10 m comes out a fifth larger than keyframe by keyframe, with 300 two fifths.",
    )
    wheel_window: float = Field(
        default=2.0,
        gt=0.0,
        le=100.0,
        description="Metres of path over which wheels and map are compared. By judgement: scans drift by "
        "millimetres and good wheels by centimetres over it.",
    )
    good_local: float = Field(
        default=0.1,
        gt=0.0,
        le=100.0,
        description="Metres per 10 m of path that a good map is expected to err at most. By judgement: two "
        "cells of the map.",
    )
    good_whole: float = Field(
        default=0.5,
        gt=0.0,
        le=1000.0,
        description="Metres over the whole, the same. By judgement: a car still finds its way through doors.",
    )
    wrong_factor: float = Field(
        default=2.5,
        ge=1.0,
        le=1000.0,
        description="By what factor these must be exceeded for a map to be wrong and not only doubtful. "
        "Learned with the model, see `racecar.mapping.quality.judgement`.",
    )
    most_wheel_scale: float = Field(
        default=1.25,
        gt=1.0,
        le=100.0,
        description="Factor between lengths by scans and by wheels, from which one of both must be wrong. By "
        "judgement: worn tyres and wrong settings make some per cent, scans that do not move make any.",
    )
    complaint_share: float = Field(
        default=0.25,
        gt=0.0,
        le=1.0,
        description="Share of the expected error that a statistic must make up to be given as a reason. By "
        "judgement.",
    )
