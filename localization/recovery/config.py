"""The settings of finding the car again: when it is lost, where it could be, and which hypothesis wins."""

from pydantic import Field

from racecar.localization.sensor.config import COURSE, BeamModelConfig, RangeAgreement
from racecar.maps.settings import Settings


class AgreementShares(Settings):
    """How the beams of scans agree with the map."""

    closely: float = Field(ge=0, le=1, description="share of the beams that agree closely")
    roughly: float = Field(ge=0, le=1, description="share that agree, but not closely")
    stopped: float = Field(ge=0, le=1, description="share that read less than the map says, as by people")
    looking_through: float = Field(ge=0, le=1, description="share that read more than the map says")


class LostDetectorConfig(Settings):
    """How scans become the odds that the car is elsewhere."""

    agreement: RangeAgreement = Field(
        RangeAgreement(distance=0.25),
        description="when a beam agrees; a quarter wider than for beam skipping, as the estimate may be off "
        "too. By judgement",
    )
    close: float = Field(
        0.4, gt=0, le=1, description="share of that within which a beam agrees closely: 0.1 m. By judgement"
    )
    along: float = Field(
        0.6,
        gt=0,
        le=10,
        description="metres ahead and behind where a beam that agrees as well does not tell the place, and "
        "so not the map. Measured on 15 right maps and 43 wrong ones: of the beams that do tell, 0.31 to "
        "0.99 agree closely on the right ones and 0.02 to 0.23 on wrong ones; of all beams, 0.58 to 1 and "
        "0.12 to 0.75",
    )
    telling_beams: int = Field(
        25,
        ge=1,
        le=10_000,
        description="of a scan, that are asked whether they tell the place, evenly taken: a verdict has many "
        "scans, and all 100 beams cost a scan 0.1 ms",
    )
    unchanged_map: AgreementShares = Field(
        AgreementShares(closely=0.7, roughly=0.15, stopped=0.12, looking_through=0.03),
        description="at the right place, where the map is as the world is, until they are learned. By "
        "judgement, from simulated drives with people (`racecar benchmark accuracy`)",
    )
    changed_map: AgreementShares = Field(
        AgreementShares(closely=0.6, roughly=0.1, stopped=0.15, looking_through=0.15),
        description="the same where much has changed since the map was made, as in session_A, of which "
        "177 scans were called lost without this kind of map and 1 with it",
    )
    changed_map_probability: float = Field(
        0.1, gt=0, lt=1, description="of a map where much has changed, before any scan. By judgement"
    )
    least_kind_probability: float = Field(
        0.01,
        gt=0,
        lt=1,
        description="of a kind of map beside the likelier one, so that it can still become the likelier one "
        "soon. By judgement",
    )
    least_shares: AgreementShares = Field(
        AgreementShares(closely=0.05, roughly=0.05, stopped=0.06, looking_through=0.01),
        description="no share is taken for less, so that a single beam's logarithm does not decide. By "
        "judgement",
    )
    first_seconds: float = Field(
        2.0, gt=0, le=1000, description="seconds of scans that the usual shares count as. By judgement"
    )
    memory_seconds: float = Field(
        30.0,
        gt=0,
        le=100_000,
        description="seconds over which the shares at the right place are averaged. By judgement: a room or "
        "two at walking pace",
    )
    beams_per_second: float = Field(
        110.0,
        gt=0,
        le=100_000,
        description="independent beams in a second of scans: those side by side, and those of the next scan, "
        "are disturbed by the same. By judgement; `racecar benchmark accuracy` shows that a kidnapped car is "
        "noticed within a second and a tracked one is not called lost",
    )
    clarity_per_share: float = Field(
        4.5,
        ge=0,
        le=100,
        description="by how much less scans count (their clarity, 1 at best) per share of beams that "
        "disagree at the right place too. By judgement",
    )
    least_clarity: float = Field(
        0.15, gt=0, le=1, description="clarity where many beams disagree at the right place. By judgement"
    )
    longest_scan: float = Field(
        0.25,
        gt=0,
        le=100,
        description="seconds that one scan stands for at most, so that none decides alone after a pause. By "
        "judgement: the time between scans of a slow laser",
    )
    largest_log_odds: float = Field(
        6.0,
        gt=0,
        le=100,
        description="of being lost or not: 1 to 400. Bounded, so that no change of mind takes long. By "
        "judgement",
    )
    learning_log_odds: float = Field(
        3.0,
        ge=0,
        le=100,
        description="against being lost, from which on the shares at the right place are learned: 20 to 1. "
        "By judgement",
    )


class PlaceSearchConfig(Settings):
    """The search of the whole map for where a scan fits."""

    spacing: float = Field(
        0.2,
        gt=0,
        le=10,
        description="metres between the places that are tried: half of the deviation that the search's beam "
        "model allows, so that one of them is near enough",
    )
    most_places: int = Field(
        60_000,
        ge=100,
        le=10_000_000,
        description="on a larger map they lie farther apart, so that the search stays short. By judgement",
    )
    rough_beams: int = Field(
        15,
        ge=1,
        le=10_000,
        description="with which all places are compared. Measured: with few beams everywhere and more where "
        "they fit, the search takes a third of the time",
    )
    rough_headings: int = Field(
        80,
        ge=8,
        le=4096,
        description="tried at least, with these. Measured: 104 rank the true place as high as 166 do",
    )
    likely_places: float = Field(
        0.15,
        gt=0,
        le=1,
        description="share of the places that are then compared with more beams. By judgement",
    )
    beams: int = Field(60, ge=1, le=10_000, description="with which likely places are compared. By judgement")
    headings: int = Field(
        160, ge=8, le=4096, description="tried at least, with these: 2.3° apart. By judgement"
    )
    poses: int = Field(
        4000, ge=1, le=1_000_000, description="the best, among which particles are drawn. By judgement"
    )
    beam_model: BeamModelConfig = Field(
        COURSE,
        description="wider than the one that tracks, since the car is up to half the spacing beside a place",
    )


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
