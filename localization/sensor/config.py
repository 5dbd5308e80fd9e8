"""The settings of the sensor model, and of which beams count."""

from pydantic import Field

from racecar.maps.settings import Settings


class RangeAgreement(Settings):
    """When a reading agrees with the map: it differs by at most ``distance + share * range``."""

    distance: float = Field(
        0.2,
        gt=0,
        le=5,
        description="metres. By judgement: a map's cell and a few centimetres each of the laser's noise, of "
        "the pose and of the map",
    )
    share: float = Field(
        0.02,
        ge=0,
        le=1,
        description="of the range. By judgement: a heading that is off by 1° moves the end of a beam by 2 % "
        "of its range sideways",
    )


class BeamModelConfig(Settings):
    """What a reading can be: the wall, something before it, a miss, anything; the shares need not sum to 1.

    The mixture of MIT's robotics course (RSS, lab 5), after Thrun, Burgard, Fox: Probabilistic Robotics
    (2005), section 6.3.
    """

    hit_deviation: float = Field(
        0.2,
        ge=0.02,
        le=5,
        description="standard deviation in metres of a reading of the wall. Half of the course's 8 pixels of "
        "5 cm: sharper, as bends and bare corridors need (`racecar benchmark accuracy`)",
    )
    hit: float = Field(0.74, gt=0, le=100, description="weight of readings of the wall; the course's")
    short: float = Field(
        0.07, ge=0, le=100, description="weight of readings of something before the wall; the course's"
    )
    max: float = Field(0.07, ge=0, le=100, description="weight of misses; the course's")
    random: float = Field(
        1.2,
        gt=0,
        le=100,
        description="weight of readings of anything, spread evenly over the sensor's range. Ten times the "
        "course's: more forgiving of what the map does not know (`racecar benchmark accuracy`)",
    )
    agreement: RangeAgreement = Field(
        RangeAgreement(), description="when the map explains a beam, for beam skipping"
    )


COURSE = BeamModelConfig(hit_deviation=0.4, random=0.12)
"""The course's own numbers, since its specification has 8 pixels (of 5 cm) and weights of 0.74, 0.07, 0.07,
0.12."""


class BeamSkippingConfig(Settings):
    """Which beams of a scan are left out, and how much the scan counts. After AMCL's beam skipping (nav2)."""

    particles: int = Field(
        40,
        ge=1,
        le=10_000,
        description="of the cloud, evenly taken, that each beam is compared from. By judgement: a share "
        "among 40 is known to within 8 %, for a hundredth of the step's time",
    )
    most_of_cloud: float = Field(
        0.7,
        gt=0,
        le=1,
        description="share of these from which a beam must agree with the map to be weighed. By judgement: "
        "the few particles that think otherwise are more often wrong than the rest",
    )
    notably_more: float = Field(
        0.1,
        ge=0,
        le=1,
        description="share of the beams by which more must agree from where the scan lies best on the walls "
        "for this place to be asked instead of the cloud. By judgement",
    )
    fewest_left: float = Field(
        0.5,
        ge=0,
        le=1,
        description="share of the beams; where fewer are explained all are weighed, since the pose rather "
        "than the map is wrong then. By judgement: half",
    )
    usual_share: float = Field(
        0.7,
        gt=0,
        le=1,
        description="share of the beams that agree in a usual scan; one of which fewer do counts less. By "
        "judgement; of session_A's end points 0.71 lie on the basement map's walls",
    )
    steepness: int = Field(
        4,
        ge=0,
        le=20,
        description="power of the agreeing over the usual share by which such a scan counts. Measured with "
        "`racecar benchmark accuracy` on session_A: without this, its errors reached 0.27 m",
    )
