"""Settings of the verdict on a drive."""

from pydantic import Field

from racecar.maps.settings import Settings


class KnownPlaceConfig(Settings):
    """When the car's place counts as known."""

    lost_from: float = Field(
        0.5,
        gt=0,
        lt=1,
        description="probability of being elsewhere from which the car counts as lost; by definition more "
        "likely lost than not",
    )
    dominant: float = Field(
        0.9,
        gt=0.5,
        le=1,
        description="weight of the cluster of particles from which on no other place matters; by judgement",
    )
    within: float = Field(
        0.5, gt=0, le=100, description="metres of standard deviation within which it is known; by judgement"
    )


class MapFitConfig(Settings):
    """How the scans of a drive become the odds that the map shows the place where it went."""

    prior_log_odds: float = Field(
        1.0,
        ge=-100,
        le=100,
        description="for the map before any scan. By judgement: people name the right map more often",
    )
    beams_per_metre: float = Field(
        15.0,
        gt=0,
        le=10_000,
        description="independent beams in a metre of path, as a step farther on the same is seen. "
        "Measured on 15 right and 43 wrong maps: with 20 the verdicts are the same, with 10 one of the "
        "wrong maps is uncertain instead of lost",
    )
    longest: float = Field(
        10.0,
        gt=0,
        le=100_000,
        description="metres of path to whose evidence that of a long drive adds up at most, so that a "
        "small bias, of a laser or of a map that is out of date, does not become certainty. By judgement",
    )
    longest_step: float = Field(
        3.0,
        gt=0,
        le=10,
        description="metres of path for which a scan counts at most, where few are taken. By judgement",
    )
    standing: float = Field(
        0.1,
        ge=0,
        le=10,
        description="metres of path for which all scans of a car that stands count. By judgement: what fits "
        "without motion speaks for the map, but not beyond doubt",
    )
    step: float = Field(
        0.1,
        gt=0,
        le=10,
        description="metres of motion, and radians, after which scans count anew: what the estimate of a "
        "car that stands jitters is less",
    )
    metres_per_radian: float = Field(
        0.5,
        ge=0,
        le=100,
        description="of path for which a turn on the spot counts. By judgement: it shows other walls, but "
        "less than driving does",
    )
    chosen_within: float = Field(
        3.0,
        gt=0,
        le=1000,
        description="metres of path after a search of the map, below which scans count for less, down to "
        "nothing where the search chose the place that fits best. Measured: on wrong maps scans fit for 2 to "
        "6 m as on the right one",
    )
    sure_log_odds: float = Field(
        3.0,
        gt=0,
        le=100,
        description="from which on the map counts as the right one, or as a wrong one: 20 to 1. By judgement",
    )


class VerdictConfig(Settings):
    """When a drive counts as localized, and when a search is given up."""

    known_place: KnownPlaceConfig = KnownPlaceConfig()
    map_fit: MapFitConfig = MapFitConfig()
    localized_share: float = Field(
        0.9,
        gt=0,
        le=1,
        description="of the drive on which the place must be known. By judgement: a second or two to be "
        "found in, or one kidnapping, are forgiven",
    )
    lost_share: float = Field(
        0.5,
        ge=0,
        lt=1,
        description="of the drive, below which it is lost unless the map is the right one beyond doubt. By "
        "judgement: most of it",
    )
    longest_scan: float = Field(
        1.0,
        gt=0,
        le=1000,
        description="seconds that one scan stands for at most, so that a pause of the recording is no part "
        "of the drive. By judgement: some sensors send one scan a second",
    )
    shortest_segment: float = Field(
        0.5,
        ge=0,
        le=1000,
        description="seconds of an unknown place that are reported, and between two that are one. By "
        "judgement",
    )
    most_segments: int = Field(
        20, ge=1, le=100_000, description="that are reported, the longest; by judgement"
    )
    patience: float = Field(
        10.0,
        gt=0,
        le=1e9,
        description="seconds of scans for which a car may be lost on a map that seems wrong, before the "
        "search stops. By judgement: a car that was carried elsewhere is found within a second or two "
        "(`racecar benchmark accuracy`), and some ten searches of the map fit into it",
    )
    patience_share: float = Field(
        0.1,
        ge=0,
        le=1000,
        description="of the seconds in which the place was known, that are added to it. By judgement",
    )
