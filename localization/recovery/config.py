"""The settings of finding the car again: when it is lost, where it could be, and which hypothesis wins."""

from pydantic import Field

from racecar.maps.settings import Settings


class MovingRivalConfig(Settings):
    """How a car whose odometry repeats one pose is followed as if that said nothing."""

    apart_distance: float = Field(
        0.1,
        gt=0,
        le=10,
        description="metres from where the car would stand, beyond which scans can decide which is right. By "
        "judgement: some times the error of either",
    )
    apart_angle: float = Field(0.05, gt=0, le=3.2, description="radians, likewise. By judgement")
    speed_seconds: float = Field(
        0.15,
        gt=0,
        le=100,
        description="seconds over which its speed is averaged. By judgement, as where there is no odometry",
    )
    least_speed: float = Field(
        0.1,
        ge=0,
        le=10,
        description="metres or radians per second below which a better fit does not count: a car whose "
        "wheels locked stands in the end, a little farther on. By judgement",
    )
    scans_per_second: float = Field(
        2.0,
        gt=0,
        le=1000,
        description="scans' log-likelihoods that count in a second. By judgement: more than for a hypothesis "
        "of another place, as this one lies beside the estimate and on the path that the car was on",
    )
    largest_rate: float = Field(
        30.0,
        gt=0,
        le=1000,
        description="log-odds that a second may bring at most: a third of a second decides if all is clear. "
        "By judgement",
    )
    longest_scan: float = Field(
        0.25,
        gt=0,
        le=100,
        description="seconds that one scan stands for at most, so that none decides alone after a pause. By "
        "judgement, as for being lost",
    )
    winning_log_odds: float = Field(
        10.0, gt=0, le=1000, description="over a car that stands that win: 20 000 to 1. By judgement"
    )


class HypothesisConfig(Settings):
    """When a second hypothesis of where the car is comes up, fails, or replaces the first."""

    search_from: float = Field(
        0.7,
        gt=0,
        lt=1,
        description="probability of being lost from which the map is searched; tried on recordings",
    )
    confirmed_below: float = Field(
        0.02,
        gt=0,
        le=0.5,
        description="probability of being lost below which the car is taken to be there: the first "
        "hypothesis that comes to this wins. By judgement",
    )
    trial_seconds: float = Field(
        1.0,
        gt=0,
        le=1000,
        description="that a hypothesis has before it may fail: as long as a lost car takes to be noticed "
        "(`racecar benchmark accuracy`)",
    )
