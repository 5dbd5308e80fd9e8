"""The pose that one scan came to, for whoever asks for it between scans."""

from dataclasses import dataclass, replace

from racecar.localization.odometry.motion_model_kernels import carry
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.gyro_buffer import GyroReading
from racecar.maps.sensing.odometry_faults import OdometryFaults


@dataclass(frozen=True, eq=False)
class PublishedPose:
    """Replaced as a whole by the next scan's, so that readers neither wait nor see two scans mixed."""

    estimate: PoseEstimate
    odom_from_base: Pose | None
    """At the estimate's stamp; None without odometry."""
    by_gyro: GyroReading | None
    """At the same time; None without a gyroscope."""
    faults: OdometryFaults
    """Of the odometry, as known then."""

    def carried_to(self, stamp: int, source: MotionSource) -> PoseEstimate:
        """The estimate at another stamp, by odometry, its covariance grown."""
        last = self.estimate
        step = source.step_from(self.odom_from_base, self.faults, last.stamp, stamp, self.by_gyro)
        map_from_base, covariance = carry(
            last.map_from_base, last.covariance, step.base_from_next_base, step.deviations
        )
        return replace(last, stamp=stamp, map_from_base=map_from_base, covariance=covariance, is_start=False)


def publish(estimate: PoseEstimate, source: MotionSource) -> PublishedPose:
    """An estimate, and what the source measured at its stamp."""
    return PublishedPose(estimate, source.odom_from_base, source.by_gyro, source.calibration.faults)
