"""Settings of dead reckoning: scan odometry, turn search, velocity filter, odometry lag and calibration."""

from typing import Annotated

from pydantic import Field

from racecar.maps.sensing.config import TurnFusionConfig
from racecar.maps.settings import Settings

Positive = Annotated[float, Field(gt=0.0, le=1000.0)]
"""One of several numbers of a setting; up to 1000 because no car accelerates or errs so much."""


class UprightConfig(Settings):
    """Which points of a cloud stand upright."""

    column: float = Field(
        default=0.25,
        gt=0.0,
        le=100.0,
        description="Side of the columns in which heights are compared, metres. By judgement: scan "
        "odometry's voxel.",
    )
    max_gap: float = Field(
        default=1.5,
        gt=0.0,
        le=1000.0,
        description="Metres of height without a point between floor and ceiling, which are then two things. "
        "By judgement: more than the rows of a laser leave on a wall, less than a storey.",
    )
    margin: float = Field(
        default=0.1,
        ge=0.0,
        le=10.0,
        description="Metres above the lowest and below the highest point of a column that may still be "
        "floor or ceiling. By judgement: noise, and the slope of a floor across a column.",
    )


class ScanOdometryConfig(Settings):
    """KISS-ICP (Vizzo et al., RA-L 2023) in the plane, and the local map that it registers scans against."""

    voxel_size: float = Field(
        default=0.25,
        gt=0.0,
        le=100.0,
        description="Side of a voxel of the local map, metres. Measured when chosen: KISS-ICP's own 1.0 "
        "fails indoors, 0.1 to 0.25 work.",
    )
    points_per_voxel: int = Field(
        default=6,
        ge=1,
        le=1000,
        description="Points kept in a voxel. KISS-ICP's 20 are for volumes; measured on aces, fr079 and "
        "intel, 6 give the same errors in a sixth less time.",
    )
    local_map_radius: float = Field(
        default=100.0,
        gt=0.0,
        le=10000.0,
        description="Metres about the sensor within which the local map is kept: farther than indoor lasers "
        "see, because a shorter one loses the ends of corridors.",
    )
    update_distance: float = Field(
        default=0.2,
        gt=0.0,
        le=100.0,
        description="Metres after which a scan enters the local map, so that a car that stands does not "
        "smear it. By judgement.",
    )
    update_angle: float = Field(
        default=0.1, gt=0.0, le=10.0, description="The same in radians. By judgement."
    )
    initial_threshold: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Metres by which predictions are first taken to be off; KISS-ICP then adapts it. By "
        "judgement: a quarter of its outdoor 2.0.",
    )
    min_motion: float = Field(
        default=0.01,
        gt=0.0,
        le=1.0,
        description="Metres that a prediction must miss by to change that threshold. By judgement: the "
        "noise of a laser.",
    )
    remembered_updates: int = Field(
        default=60,
        ge=1,
        le=10000,
        description="Updates of the local map that survive a restart: 12 m of path or more, by judgement as "
        "far as most rooms reach.",
    )
    upright: UprightConfig = UprightConfig()


class TurnSearchConfig(Settings):
    """The search for the turn between two scans where no wheels report it."""

    max_turn: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Radians to each side that are searched. By judgement: a car turns by ten degrees "
        "between two scans at times, which fr079 showed.",
    )
    predicted_turn: float = Field(
        default=0.02,
        gt=0.0,
        le=10.0,
        description="Radians within which a turn counts as the predicted one. By judgement: a step and a "
        "half of the search.",
    )
    reach: float = Field(
        default=0.2,
        gt=0.0,
        le=100.0,
        description="Metres to each side that are searched, in which the prediction may be off. By "
        "judgement.",
    )
    min_gain: float = Field(
        default=1.1,
        ge=1.0,
        le=1000.0,
        description="How many times better another turn must fit than the predicted one. By judgement.",
    )
    min_score: float = Field(
        default=0.3,
        gt=0.0,
        le=1.0,
        description="Least mean likelihood of a turn that is taken. By judgement.",
    )
    radius: float = Field(
        default=15.0,
        gt=0.0,
        le=10000.0,
        description="Metres of sight that are used: far walls show a turn too, but slow the search. By "
        "judgement.",
    )
    min_points: int = Field(
        default=30, ge=1, le=10000, description="Points of a scan below which it shows no turn. By judgement."
    )
    max_points: int = Field(
        default=200, ge=1, le=100000, description="Points that are searched with, for speed. By judgement."
    )


class VelocityFilterConfig(Settings):
    """The Kalman filter of place and velocity that follows the laser where wheels are silent."""

    max_interval: float = Field(
        default=0.25,
        gt=0.0,
        le=100.0,
        description="Seconds between two scans beyond which a velocity predicts too little. Measured: "
        "serves lasers of five scans a second (pytest tests/simulated/test_hard_places.py).",
    )
    acceleration: tuple[Positive, Positive, Positive] = Field(
        default=(3.0, 1.0, 6.0),
        description="Root of the spectral density of the white noise in forward and sideways acceleration "
        "(m/s², over a second) and angular acceleration (rad/s²). By judgement: what a race car does.",
    )
    initial_velocity_sigma: tuple[Positive, Positive, Positive] = Field(
        default=(2.0, 0.5, 2.0),
        description="Standard deviation of the velocity at the start: m/s, m/s, rad/s. By judgement.",
    )
    initial_place_sigma: tuple[Positive, Positive, Positive] = Field(
        default=(0.02, 0.02, 0.02),
        description="Standard deviation of the place at the start: m, m, rad. By judgement: a scan match's.",
    )
    scan_odometry_sigma: tuple[Positive, Positive, Positive] = Field(
        default=(0.5, 0.5, 0.25),
        description="By how much scan odometry may miss a step since the keyframe: m, m, rad. So wide that "
        "it decides only where scan matches leave a direction open; aces without wheels showed the need.",
    )
    min_overlap: float = Field(
        default=0.2,
        ge=0.0,
        le=1.0,
        description="Share of points that must match the keyframe for a scan to be followed. By judgement.",
    )
    max_surprise: float = Field(
        default=40.0,
        gt=0.0,
        le=10000.0,
        description="Squared Mahalanobis distance between prediction and match beyond which the filter "
        "starts again. By judgement: by the chi-square distribution of three dimensions 16 is exceeded "
        "once in a thousand times, but accelerations have heavier tails.",
    )
    trusted_after: float = Field(
        default=10.0,
        gt=0.0,
        le=1000.0,
        description="Scans that must have been followed until it is trusted. By judgement.",
    )
    full_interval: float = Field(
        default=0.05,
        gt=0.0,
        le=10.0,
        description="Seconds between two scans from which one counts in full towards that; sooner ones "
        "count in proportion, because velocities are wrong where stamps come in bunches. By judgement.",
    )


class LagEstimateConfig(Settings):
    """When a lag between two clocks is known. Measured on 15 simulated drives whose wheels lag by -0.14 to
    0.15 s: where it is known it is right to 0.015 s."""

    block: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Seconds of a block of the bootstrap: as long as a window, for what windows share is no "
        "news. With 1 s the same lags are known.",
    )
    min_turn: float = Field(
        default=0.05,
        ge=0.0,
        le=10.0,
        description="Radians that both must turn in a window: three degrees, by judgement. Noise shows no "
        "lag, nor a turn by hand of which the wheels know nothing.",
    )
    min_blocks: int = Field(
        default=5,
        ge=2,
        le=10_000,
        description="Blocks below which nothing is known. Of pieces of so many blocks of 15 simulated drives "
        "95 % err by up to 0.021 s, as with 6; with 3 by 0.028.",
    )
    resamplings: int = Field(default=100, ge=10, le=100_000, description="Of the bootstrap. By judgement.")
    sigmas: float = Field(
        default=4.0,
        ge=0.0,
        le=100.0,
        description="Standard deviations that a lag must show by. Measured: 6 and more where it is true, up "
        "to 3.7 where odometry comes five or ten times a second and few turns tell.",
    )


class OdometryLagConfig(Settings):
    """How the lag between the clocks of wheels and scans is learned."""

    max_lag: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Seconds to each side that are tried: some more than those up to which no clock is "
        "shifted beforehand (`TurnAgreementConfig.usual_lag`), since at the bound none is known.",
    )
    step: float = Field(
        default=0.02,
        gt=0.0,
        le=10.0,
        description="Seconds from one lag tried to the next: the usual time between two odometry messages.",
    )
    turn_interval: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Seconds over which turns are compared. Over a shorter time, scans skewed by wheels at "
        "a wrong time would seem to agree with them; the value is by judgement.",
    )
    max_turn_interval: float = Field(
        default=1.5, gt=0.0, le=1000.0, description="Seconds beyond which there is a gap in it. By judgement."
    )
    max_waiting: int = Field(
        default=200,
        ge=1,
        le=100000,
        description="Scans that wait for odometry that has not come yet; it may have stopped. By judgement.",
    )
    max_disagreement: float = Field(
        default=0.3,
        gt=0.0,
        le=100.0,
        description="Radians by which turns of wheels and scans may differ; more counts as much. By "
        "judgement: a slip.",
    )
    turn_until_settled: float = Field(
        default=4.0,
        gt=0.0,
        le=1000.0,
        description="Radians that the car must have turned, to and fro, until a lag that the turns do not "
        "show is no longer believed from elsewhere. By judgement.",
    )
    max_blocks: int = Field(
        default=200,
        ge=2,
        le=100_000,
        description="Blocks that are remembered, as clocks drift. By judgement: some minutes of driving.",
    )
    estimate: LagEstimateConfig = LagEstimateConfig()


class WheelCalibrationConfig(Settings):
    """The fit of the wheels' systematic errors, and how far they are trusted after it."""

    min_spans: int = Field(
        default=40, ge=2, le=10000, description="Spans below which nothing is fitted. By judgement."
    )
    min_reach: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Metres of a span from which it shows the path's scale. By judgement: some times what "
        "a match errs by.",
    )
    spans_per_step: float = Field(
        default=8.0,
        ge=1.0,
        le=1000.0,
        description="Spans in which each step takes part as one of its own, so that they count once. By the "
        "number of keyframes that each is tied to.",
    )
    initial_sigma: float = Field(
        default=0.05,
        gt=0.0,
        le=10.0,
        description="Standard deviation of a step, metres and radians, before anything is fitted. By "
        "judgement.",
    )
    initial_step: float = Field(
        default=0.3,
        gt=0.0,
        le=10.0,
        description="Metres of a usual step, before anything is fitted: as far as keyframes are apart.",
    )
    turn_per_metre_sigma: float = Field(
        default=0.02,
        gt=0.0,
        le=1.0,
        description="Radians that wheels usually miss per metre. On aces, fr079 and intel up to 0.06.",
    )
    scale_sigma: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="Share by which turns and distances are usually wrong. Measured on recordings: 2 to 5 %; "
        "twice as much, for a wheel of another size is no rarity. With 0.05, wheels that missed 13 % on "
        "simulated open ground were corrected by less.",
    )
    bias_turn_sigma: float = Field(
        default=0.003,
        gt=0.0,
        le=1.0,
        description="Radians by which matches are usually biased. With ground returns outdoors: 0.0007.",
    )
    bias_distance_sigma: float = Field(
        default=0.01,
        gt=0.0,
        le=1.0,
        description="Metres likewise. By judgement: as much as a laser errs by.",
    )
    min_sigma: float = Field(
        default=0.01,
        gt=0.0,
        le=1.0,
        description="Least standard deviation of a step, metres and radians: no better than a scan match. "
        "By judgement.",
    )
    max_sigma: float = Field(
        default=0.3, gt=0.0, le=100.0, description="Largest one: a whole keyframe step. By judgement."
    )
    tail_share: float = Field(
        default=0.8,
        gt=0.0,
        lt=1.0,
        description="Share of the steps that err less than the tail: what a step is worth before scans were "
        "matched, as it may be one of the bad ones. By judgement.",
    )
    loss_width: float = Field(
        default=2.0,
        gt=0.0,
        le=1000.0,
        description="Width of the Cauchy loss of the fit, in spreads of the residuals. The 95 % efficiency "
        "on Gaussian errors is at 2.385 (Holland and Welsch, 1977); by judgement a little less.",
    )

    def clipped(self, sigma: float) -> float:
        """A standard deviation within the limits."""
        return min(max(sigma, self.min_sigma), self.max_sigma)


class DeadReckoningConfig(Settings):
    """How the motion since the last keyframe is predicted."""

    lost_distance: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="Metres by which scan odometry may miss a step between keyframes before it starts "
        "again. By judgement.",
    )
    lost_angle: float = Field(default=0.5, gt=0.0, le=100.0, description="The same in radians. By judgement.")
    unseen_turn: float = Field(
        default=0.2,
        gt=0.0,
        le=100.0,
        description="Radians that scans show while wheels repeat one heading to the last bit, from which on "
        "that is no heading. By judgement: session_A's car turned by up to 0.09 while it steered straight.",
    )
    sparse_interval: float = Field(
        default=0.075,
        gt=0.0,
        le=10.0,
        description="Seconds between two scans from which scan odometry corrects the velocity filter; when "
        "scans come more often, the laser moves too little between them for it. Measured on simulated cheap "
        "lasers (pytest tests/simulated/test_hard_places.py).",
    )
    blind_interval: float = Field(
        default=2.0,
        ge=0.0,
        le=100.0,
        description="Seconds for which a car without wheel odometry is thought to go on as before while no "
        "beam meets anything; then it is searched for where it was by then. By judgement: as long as a gap "
        "after which it is searched for.",
    )
    unknown_sigma: tuple[Positive, Positive, Positive] = Field(
        default=(1.0, 1.0, 1.5),
        description="Standard deviation of the motion over a longer time that nothing measured: m, m, rad. "
        "By judgement.",
    )
    scan_odometry: ScanOdometryConfig = ScanOdometryConfig()
    turn_search: TurnSearchConfig = TurnSearchConfig()
    velocity_filter: VelocityFilterConfig = VelocityFilterConfig()
    lag: OdometryLagConfig = OdometryLagConfig()
    turn_fusion: TurnFusionConfig = TurnFusionConfig()
    calibration: WheelCalibrationConfig = WheelCalibrationConfig()
