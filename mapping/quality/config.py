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
        default=5.0,
        gt=0.0,
        le=1000.0,
        description="Metres of path, up to which two keyframes are neighbours and beyond which they belong "
        "to different passes. By judgement: drift is millimetres over it, and scans some metres apart have "
        "neighbours too.",
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
        default=600, ge=1, le=1_000_000, description="Pairs of neighbours, likewise. By judgement."
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
        description="Metres from which wheels and map are said to differ: two cells of the map.",
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
    most_jump: float = Field(
        default=0.5,
        gt=0.0,
        le=1000.0,
        description="Metres that a step may be longer than the car can have driven. By judgement: what a "
        "good map may err; see `racecar.mapping.quality.jumps`.",
    )
    most_unseen_way: float = Field(
        default=3.0,
        gt=0.0,
        le=10_000.0,
        description="Metres that the car would usually go while it stands, by its wheels alone, "
        "between walls that would not show it being carried along them. By judgement: six times what a good "
        "map may err. Robots that stood in the corridors of aces, fr079, intel and a hall had at most 0.8 m.",
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
    places: int = Field(
        default=60,
        ge=2,
        le=10_000,
        description="Keyframes, evenly over the path, of which the spread is computed. By judgement: its "
        "mean is steady.",
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
        description="Factor between lengths by scans and by wheels, from which one of the two must be wrong. "
        "By judgement: worn tyres and wrong settings make some per cent, scans that do not move make any.",
    )
    most_overruled: float = Field(
        default=0.5,
        gt=0.0,
        le=1.0,
        description="Share of the steps on which scans may contradict the wheels. By judgement: wheels slip "
        "now and then, and a robot is carried for a while.",
    )
    most_denied: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Share of `wheel_window` that the map may deny the wheels where no loop closure decides. "
        "On 237 maps of known error no good one with wheels that were not turned round had more than 0.48; "
        "of 9 wrong ones that nothing else told, 4 had more than 0.8.",
    )
    most_unlike_earlier: float = Field(
        default=0.3,
        gt=0.0,
        le=1.0,
        description="Share of what earlier drives saw that the last one may look through at most places. "
        "Measured where half of the furniture was moved between drives: 0.1; with the last one 0.2 m off "
        "0.26, with 0.5 m or 3 degrees 0.4 to 0.8.",
    )
    complaint_share: float = Field(
        default=0.25,
        gt=0.0,
        le=1.0,
        description="Share of the expected error that a statistic must make up to be given as a reason. By "
        "judgement.",
    )
