"""Settings of what a recording is asked about its own sensors before it is mapped."""

from pydantic import Field

from racecar.mapping.matching.config import ScanMatchingConfig
from racecar.mapping.odometry.config import LagEstimateConfig, ScanOdometryConfig
from racecar.maps.settings import Settings


class ProfileTurnConfig(Settings):
    """The search for the turn between two scans by their ranges over the bearing."""

    max_turn: float = Field(
        default=0.8,
        gt=0.0,
        le=3.1,
        description="Radians to each side that are searched. By judgement: robots turn on the spot at "
        "2 rad/s, and slow lasers make five scans a second.",
    )
    max_difference: float = Field(
        default=0.3,
        gt=0.0,
        le=10.0,
        description="Difference of the logarithms of two ranges from which they count as of different "
        "things. By judgement: a third of the range.",
    )
    min_share: float = Field(
        default=0.5,
        gt=0.0,
        le=1.0,
        description="Share of the bearings known in both, of the most of any turn, below which a turn is not "
        "judged: at the edge of a narrow field of view few beams agree by chance. By judgement.",
    )
    min_gain: float = Field(
        default=0.8,
        gt=0.0,
        le=1.0,
        description="Share of the guess's difference that another turn may leave. By judgement: steady "
        "motion is mostly right.",
    )


class ScanTrackConfig(Settings):
    """How the laser is followed from scan to scan."""

    min_interval: float = Field(
        default=0.07,
        ge=0.0,
        le=10.0,
        description="Seconds between two scans that are followed, at least: more often, the laser hardly "
        "moves between them. By judgement: every third scan of a laser of 40 a second, every one of an "
        "RPLIDAR.",
    )
    max_interval: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="Seconds between two scans beyond which a track is not continued. By judgement: a robot "
        "can turn anywhere meanwhile.",
    )
    turn_search_interval: float = Field(
        default=0.075,
        gt=0.0,
        le=100.0,
        description="Seconds between two scans from which the turn is searched. By judgement: in less a "
        "robot turns by less than registration bears.",
    )
    standing_change: float = Field(
        default=0.01,
        ge=0.0,
        le=1.0,
        description="Metres by which a range must change to count as changed. By judgement: the resolution "
        "of SICK lasers.",
    )
    standing_share: float = Field(
        default=0.05,
        ge=0.0,
        le=1.0,
        description="Share of the ranges that may have changed while the laser stands. By judgement: "
        "someone walks by.",
    )
    max_points: int = Field(
        default=400,
        ge=10,
        le=100_000,
        description="Points of a scan that are registered, for speed. By judgement: the beams of common "
        "lasers.",
    )
    jitter: float = Field(
        default=0.02,
        ge=0.0,
        le=1.0,
        description="Metres and radians from one scan to the next below which nothing counts as travelled or "
        "turned. By judgement: the noise of a match.",
    )
    turn_search: ProfileTurnConfig = ProfileTurnConfig()
    scan_odometry: ScanOdometryConfig = ScanOdometryConfig()


class SweepOrderConfig(Settings):
    """How the order of the beams in time is told."""

    max_apart: float = Field(
        default=1.6,
        gt=0.0,
        le=100.0,
        description="Seconds between the two scans of a pair, at most. Prototype: they see nearly the same.",
    )
    max_pairs: int = Field(default=240, ge=1, le=100_000, description="Pairs that are compared. Prototype.")
    first_pairs: int = Field(
        default=60,
        ge=1,
        le=100_000,
        description="Pairs from which sensors whose beams are as recorded are recognized. By judgement: a "
        "quarter.",
    )
    max_uses: int = Field(
        default=4, ge=1, le=1000, description="Pairs that one scan may be in. By judgement."
    )
    min_turn_rate_difference: float = Field(
        default=0.1,
        ge=0.0,
        le=10.0,
        description="Radians per second by which the two scans of a pair must turn differently, since two "
        "that turn alike are skewed alike. By judgement.",
    )
    block: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="Seconds of a block of the bootstrap: pairs within it err together. Prototype.",
    )
    min_blocks: int = Field(
        default=8,
        ge=2,
        le=10_000,
        description="Blocks below which nothing is decided. By judgement: their spread is not known from "
        "fewer.",
    )
    resamplings: int = Field(default=200, ge=10, le=100_000, description="Of the bootstrap. By judgement.")
    min_sigmas_over_recorded: float = Field(
        default=2.0,
        ge=0.0,
        le=100.0,
        description="Standard deviations by which the reversed order must beat the recorded one. Prototype: "
        "7 of 7 RPLIDARs, no false alarm in 51 recordings.",
    )
    min_sigmas_over_none: float = Field(
        default=1.5,
        ge=0.0,
        le=100.0,
        description="The same over a sweep that takes no time. Prototype.",
    )
    max_scale: float = Field(
        default=-0.6,
        lt=0.0,
        ge=-10.0,
        description="The sweep that fits best, as a multiple of the recorded one, above which it is not "
        "reversed. Prototype.",
    )
    max_scale_sigma: float = Field(
        default=0.2, gt=0.0, le=10.0, description="Standard deviation of that, at most. Prototype."
    )


class WindowConfig(Settings):
    """The stretches of time over which motions are compared."""

    length: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Seconds. Prototype: in less, the noise of a track hides slow turns.",
    )
    max_length: float = Field(
        default=2.0, gt=0.0, le=1000.0, description="Seconds beyond which there is a gap in it. By judgement."
    )
    step: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Seconds from the beginning of one to that of the next. By judgement.",
    )


class TurnAgreementConfig(Settings):
    """How the turns of wheels and scans are compared."""

    max_lag: float = Field(
        default=5.0,
        gt=0.0,
        le=60.0,
        description="Seconds to each side that are tried. By judgement: computers whose clocks are not "
        "synchronized are seconds apart, or so far that no turn tells.",
    )
    step: float = Field(
        default=0.02,
        gt=0.0,
        le=1.0,
        description="Seconds from one lag tried to the next: the usual time between two odometry messages.",
    )
    usual_lag: float = Field(
        default=0.4,
        ge=0.0,
        le=60.0,
        description="Seconds that wheels and scans may be apart without a clock being wrong: buses and "
        "drivers delay so much. Measured on strangers' recordings: up to 0.33.",
    )
    peak_width: float = Field(
        default=0.5,
        gt=0.0,
        le=60.0,
        description="Seconds about the best lag within which others are the same hypothesis. By judgement: "
        "the length of a window.",
    )
    max_difference: float = Field(
        default=0.3,
        gt=0.0,
        le=10.0,
        description="Radians by which turns may differ in a window; more counts as much. By judgement: a "
        "slip.",
    )
    min_covered: float = Field(
        default=0.5,
        gt=0.0,
        le=1.0,
        description="Share of the turns that the wheels must cover at a lag. By judgement.",
    )
    min_turn: float = Field(
        default=1.5,
        gt=0.0,
        le=1000.0,
        description="Radians that the scans must have turned, to and fro. By judgement: a quarter turn there "
        "and back would be half.",
    )
    min_turn_of_far_lag: float = Field(
        default=4.0,
        gt=0.0,
        le=1000.0,
        description="The same for a lag beyond the usual: there are many of them, and one fits few turns by "
        "chance. By judgement, as `OdometryLagConfig.turn_until_settled`.",
    )
    max_share_left: float = Field(
        default=0.6,
        gt=0.0,
        le=1.0,
        description="Share of the scans' turns that the wheels may leave where they agree. Measured on 30 "
        "recordings: the true hypothesis leaves 0.03 to 0.55, a wrong one mostly over 1.",
    )
    max_share_of_rival: float = Field(
        default=0.6,
        gt=0.0,
        le=1.0,
        description="Share of what the best other hypothesis leaves that one which speaks against the "
        "recording may leave. Measured likewise: 0.04 to 0.1 where it is true, 0.8 and more elsewhere.",
    )
    window: WindowConfig = WindowConfig()
    lag: LagEstimateConfig = LagEstimateConfig()


class TurnRatioConfig(Settings):
    """How the scale of another sensor's turns is compared with that of the scans' turns."""

    min_turn: float = Field(
        default=2.0,
        gt=0.0,
        le=1000.0,
        description="Radians that the scans must have turned, to and fro. By judgement: a bend or two.",
    )
    min_correlation: float = Field(
        default=0.9,
        gt=0.0,
        le=1.0,
        description="Correlation of the turns of both from which they measure the same. Measured on 30 "
        "recordings: 0.93 to 1, and 0.97 with scans whose angles are stated half.",
    )
    block: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="Seconds of a block of the bootstrap, as of `SweepOrderConfig`.",
    )
    min_blocks: int = Field(
        default=6,
        ge=2,
        le=10_000,
        description="Blocks below which nothing is decided: their spread is not known from fewer. By "
        "judgement.",
    )
    resamplings: int = Field(default=100, ge=10, le=100_000, description="Of the bootstrap. By judgement.")
    right_factor: float = Field(
        default=1.4,
        gt=1.0,
        le=10.0,
        description="Factor between the turns of both within which none is wrong. Measured on recordings "
        "that are right: 0.80 to 1.07; steering that is not calibrated is off by so much.",
    )


class WallStraightnessConfig(Settings):
    """How walls tell the scale of the bearings."""

    width: float = Field(
        default=0.7,
        gt=0.0,
        le=3.0,
        description="Radians of a piece of a wall, 40°. Measured on 30 recordings: wider ones are rare, of "
        "narrower ones each errs by 10 %.",
    )
    min_beams: int = Field(
        default=12, ge=3, le=10_000, description="Beams of a piece at least, against noise. By judgement."
    )
    max_scans: int = Field(
        default=100, ge=1, le=100_000, description="Scans that are looked at, for speed. By judgement."
    )
    min_scans: int = Field(
        default=15, ge=1, le=100_000, description="Scans with a wall that tells, at least. By judgement."
    )
    min_walls: int = Field(
        default=30, ge=1, le=100_000, description="Pieces that tell, at least. By judgement."
    )
    max_spread: float = Field(
        default=1.35,
        gt=1.0,
        le=10.0,
        description="Ratio of the upper and the lower quartile of the factors at most. Measured: 1.05 to "
        "1.25 between walls, 1.4 and more where clutter or bends prevail.",
    )
    max_obliqueness: float = Field(
        default=3.0,
        gt=1.0,
        le=100.0,
        description="Ratio of the longest and the shortest range of a piece at most: beyond are corners and "
        "doors. By judgement.",
    )
    max_noise: float = Field(
        default=0.03,
        gt=0.0,
        le=1.0,
        description="Metres by which a straight wall may be rough: what common lasers err by. By judgement.",
    )
    min_gain: float = Field(
        default=3.0,
        gt=1.0,
        le=100.0,
        description="Times as much that the worst factor must leave as the best one. By judgement.",
    )
    right_factor: float = Field(
        default=1.2,
        gt=1.0,
        le=10.0,
        description="Factor within which bearings are as stated. Measured on 30 recordings: walls that agree "
        "say 0.94 to 1.03.",
    )
    agreed_factor: float = Field(
        default=1.1,
        gt=1.0,
        le=10.0,
        description="The same beyond which bearings are not as stated if wheels, gyroscope and walls all say "
        "so. Measured: wheels and gyroscope of simulated cars turn as the scans within 1.04, walls as above.",
    )
    close_agreement: float = Field(
        default=1.05,
        gt=1.0,
        le=10.0,
        description="Factor by which these may then differ. Measured with angles stated 1.2 times as wide: "
        "1.01.",
    )
    agreement: float = Field(
        default=1.15,
        gt=1.0,
        le=10.0,
        description="Factor by which walls and turns may differ and yet say the same. Measured on a "
        "simulated drive with stated angles half as wide: 1.04.",
    )


class MountConfig(Settings):
    """How the laser's place on the base is found from the motions of both, and when it is believed."""

    min_distance: float = Field(
        default=0.05,
        gt=0.0,
        le=10.0,
        description="Metres that base and laser must travel in a window to have a direction. By judgement: "
        "five times the noise of a track.",
    )
    max_turn_difference: float = Field(
        default=0.15,
        gt=0.0,
        le=10.0,
        description="Radians by which wheels and scans may differ in a window that is used. By judgement: a "
        "slip or a lost track.",
    )
    min_windows: int = Field(
        default=6,
        ge=4,
        le=10_000,
        description="Windows with travel below which nothing is estimated. By judgement: three times the "
        "unknowns, with two equations each.",
    )
    min_certain_windows: int = Field(
        default=15,
        ge=4,
        le=10_000,
        description="Windows with travel below which nothing is believed that speaks against the recording. "
        "By judgement: the prototype wanted 20 that overlap.",
    )
    min_noise: float = Field(
        default=0.005,
        gt=0.0,
        le=1.0,
        description="Metres; motions over a window are never taken to be better. By judgement.",
    )
    usual_distance: float = Field(
        default=0.3,
        gt=0.0,
        le=100.0,
        description="Metres, standard deviation of the laser's place about the base's origin before anything "
        "was seen. By judgement: half a small robot.",
    )
    min_consistency: float = Field(
        default=0.8,
        gt=0.0,
        lt=1.0,
        description="Mean cosine of the angle between the directions of travel by wheels and by scans from "
        "which a place is believed. Prototype: 0.8 in 20 windows; measured 0.9 to 1 on robots that drive.",
    )
    max_yaw_sigma: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        description="Radians, standard deviation of the yaw at most. By judgement: three degrees.",
    )
    max_right_angle_sigma: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="The same near a multiple of a right angle. By judgement: to the next one it is fifteen "
        "times that.",
    )
    max_offset_sigma: float = Field(
        default=0.03,
        gt=0.0,
        le=1.0,
        description="Metres, standard deviation of the laser's offset from the base up to which it is used. "
        "By judgement: a cell of the map.",
    )
    offset_sigmas: float = Field(
        default=3.0,
        ge=0.0,
        le=100.0,
        description="Standard deviations that an offset must show by. By convention.",
    )
    max_doubt_of_rival: float = Field(
        default=0.5,
        gt=0.0,
        lt=1.0,
        description="Share of what one reading lacks to full consistency that a better one may lack. "
        "Measured on a simulated drive: 0.005 where only the yaw is inverted.",
    )
    max_path_ratio: float = Field(
        default=3.0,
        gt=1.0,
        le=100.0,
        description="Ratio of the paths by wheels and by scans, or its inverse, beyond which neither is "
        "believed. By judgement.",
    )
    min_path_consistency: float = Field(
        default=0.98,
        gt=0.0,
        le=1.0,
        description="Mean cosine between the directions of travel below which the scans were not followed "
        "well enough to tell a distance. Measured: 0.999 on simulated drives, 0.88 on a recording whose "
        "wheels are right and whose scans seem to go half as far again.",
    )
    min_yaw_error: float = Field(
        default=0.26,
        gt=0.0,
        le=3.2,
        description="Radians by which a yaw must be off to be a fault of its own: 15 degrees. By judgement, "
        "since slip and steering make some degrees.",
    )
    right_angle_tolerance: float = Field(
        default=0.18,
        gt=0.0,
        le=0.78,
        description="Radians about a multiple of a right angle within which a laser is taken to be mounted "
        "so: ten degrees, by judgement. People mount along edges.",
    )


class DistanceRatioConfig(Settings):
    """How the distances of the wheels are compared with those of the scans."""

    min_distance: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Metres that the scans must move in a window that counts. By judgement: ten times the "
        "noise of a track.",
    )
    max_turn_difference: float = Field(
        default=0.15,
        gt=0.0,
        le=10.0,
        description="Radians by which both may turn differently in it, as `MountConfig.max_turn_difference`.",
    )
    min_shown: float = Field(
        default=0.15,
        ge=0.0,
        le=1.0,
        description="Mean square of the cosine between surfaces' normals and the direction of travel from "
        "which scans show how far they went. Measured: 0.1 in the barest corridor of a simulated building, "
        "0.25 and more in rooms; nothing changes between 0.1 and 0.3 there.",
    )
    min_windows: int = Field(
        default=10, ge=2, le=10_000, description="Windows that count, at least. By judgement: ten seconds."
    )
    max_spread: float = Field(
        default=1.3,
        gt=1.0,
        le=10.0,
        description="Ratio of the upper and the lower quartile at most. Measured: up to 1.2 on 15 recordings "
        "whose scans were followed rightly, 1.5 and more where they were not.",
    )
    resamplings: int = Field(default=100, ge=10, le=100_000, description="Of the bootstrap. By judgement.")
    least: float = Field(
        default=0.84,
        gt=0.0,
        lt=1.0,
        description="Ratio below which one of the two is wrong. Measured on recordings that are right: 0.87 "
        "to 1.05; the mapper learns 10 % by itself, and with 20 % it bends a simulated building.",
    )
    most: float = Field(default=1.15, gt=1.0, le=10.0, description="The same above which. Measured likewise.")
    min_alignment: float = Field(
        default=0.7,
        ge=0.0,
        le=1.0,
        description="Mean agreement of the directions of travel below which wheels do not go where they "
        "look. Measured: 0.9 and more where they do, 0.54 with x and y exchanged.",
    )
    min_windows_of_direction: int = Field(
        default=20, ge=2, le=10_000, description="Windows for that, at least. By judgement: 20 seconds."
    )


class OdometryFaultConfig(Settings):
    """When odometry counts as stuck, as without turns, and as impossible."""

    min_distance: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Metres that the scans must move in a window that counts. By judgement.",
    )
    min_turn: float = Field(
        default=0.1, gt=0.0, le=10.0, description="Radians that they must turn, or that. By judgement."
    )
    farthest_laser: float = Field(
        default=1.0,
        ge=0.0,
        le=10.0,
        description="Metres that a laser sits from the middle of the turns at most, by judgement: so far it "
        "travels for each radian that a robot turns on the spot.",
    )
    max_share: float = Field(
        default=0.02,
        gt=0.0,
        lt=1.0,
        description="Of these that the wheels may move in such a window and be still. By judgement: noise of "
        "an encoder.",
    )
    max_share_of_distance: float = Field(
        default=0.05,
        gt=0.0,
        lt=1.0,
        description="Of what the scans travel that the wheels may report and go nowhere: drift to the side. "
        "By judgement.",
    )
    min_windows: int = Field(
        default=20, ge=1, le=10_000, description="Windows that must have moved. By judgement: ten seconds."
    )
    min_still_share: float = Field(
        default=0.95,
        gt=0.0,
        le=1.0,
        description="Share of them in which the wheels must be still. By judgement.",
    )
    min_jumps: int = Field(
        default=5,
        ge=1,
        le=10_000,
        description="Steps faster than any robot below which odometry is possible: drivers start anew. By "
        "judgement.",
    )
    max_jump_share: float = Field(
        default=0.005,
        gt=0.0,
        lt=1.0,
        description="Share of the steps that may be so. By judgement: a yaw in degrees jumps wherever it "
        "wraps, and where the robot turns.",
    )


class BeginningConfig(Settings):
    """How much of a recording is looked at."""

    min_scans: int = Field(
        default=60, ge=2, le=100_000, description="Scans that are followed at least. By judgement."
    )
    max_scans: int = Field(
        default=2000,
        ge=2,
        le=1_000_000,
        description="Scans that are followed at most: two minutes of a fast laser. By judgement, so that it "
        "takes seconds.",
    )
    min_turn: float = Field(
        default=3.0,
        gt=0.0,
        le=1000.0,
        description="Radians, to and fro, after which they may suffice, if nothing speaks against the "
        "recording. By judgement: half of what its faults need.",
    )
    min_distance: float = Field(
        default=3.0,
        gt=0.0,
        le=10_000.0,
        description="Metres of path after which they may suffice. By judgement.",
    )
    max_level: int = Field(
        default=8,
        ge=1,
        le=64,
        description="By what factor both may grow while something is open. By judgement.",
    )


class SelfCalibrationConfig(Settings):
    """What the beginning of a recording is asked about its sensors."""

    beginning: BeginningConfig = BeginningConfig()
    track: ScanTrackConfig = ScanTrackConfig()
    matching: ScanMatchingConfig = ScanMatchingConfig()
    window: WindowConfig = WindowConfig(length=1.0)
    sweep_order: SweepOrderConfig = SweepOrderConfig()
    turns: TurnAgreementConfig = TurnAgreementConfig()
    turn_ratio: TurnRatioConfig = TurnRatioConfig()
    walls: WallStraightnessConfig = WallStraightnessConfig()
    mount: MountConfig = MountConfig()
    distances: DistanceRatioConfig = DistanceRatioConfig()
    odometry_fault: OdometryFaultConfig = OdometryFaultConfig()
