import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.commands.cli import run
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.sensors.corrections import Corrections
from racecar.sensors.findings import Finding
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.learned_corrections import KnownSensors, learned_corrections
from racecar.sensors.self_calibration.mount import MotionReading, MountEstimate
from racecar.sensors.self_calibration.self_calibration import SelfCalibration
from racecar.sensors.self_calibration.turn_agreement import TurnAgreement
from racecar.sensors.self_calibration.wheel_track import WheelSigns
from racecar.sensors.yaw_rate import YawRate
from tests.sensors.self_calibration.moving_laser import STEP, odometry_of, scans_of, winding_drive

SECONDS = 16.0
DRIVE = winding_drive(SECONDS)
BACKWARDS = np.array([-0.2, 0.0, np.pi])


class Recording:
    """A robot's drive, to be spoiled in one way or another."""

    def __init__(self, base_from_laser: Pose = IDENTITY) -> None:
        self.scans = scans_of(compose(DRIVE, base_from_laser), SECONDS)
        self.odometry = odometry_of(DRIVE, SECONDS)
        self.yaw_rates: list[YawRate] = []
        self.told: Pose | None = None

    def change_odometry(self, change: Callable[[Odometry], Odometry]) -> "Recording":
        self.odometry = [change(sample) for sample in self.odometry]
        return self

    def multiply(self, *factors: float) -> "Recording":
        return self.change_odometry(
            lambda sample: replace(sample, odom_from_base=sample.odom_from_base * np.array(factors))
        )

    def write(self, path: Path) -> Path:
        with BagWriter(path) as writer:
            if self.told is not None:
                writer.write_static_transform(self.told)
            for sample in self.odometry:
                writer.write_odometry(sample)
            for yaw_rate in self.yaw_rates:
                writer.write_yaw_rate(replace(yaw_rate, stamp=yaw_rate.stamp + 1_000_000_000))
            for scan in self.scans:
                _write_scan(writer, scan)
        return path


def _write_scan(writer: BagWriter, scan: Scan) -> None:
    count = len(scan.ranges)
    increment = float(scan.time_offsets[1] - scan.time_offsets[0])
    writer.write_scan(
        scan.stamp + 1_000_000_000,
        scan.ranges.astype(np.float32),
        angle_min=float(scan.bearings[0]),
        angle_increment=float(scan.bearings[1] - scan.bearings[0]),
        time_increment=abs(increment),
        scan_time=count * abs(increment),
        range_min=0.05,
        range_max=25.0,
    )


def corrections_of(recording: Recording, folder: Path, **options: object) -> tuple[Corrections, BagReader]:
    recording.change_odometry(lambda sample: replace(sample, stamp=sample.stamp + 1_000_000_000))
    with BagReader(recording.write(folder / "bag"), **options) as reader:  # type: ignore[arg-type]
        calibrate(reader, quiet=True)
        return reader._corrections, reader


def only_finding(corrections: Corrections) -> str:
    (finding,) = corrections.findings
    return finding.name


def test_a_sound_recording_is_read_as_it_stands(tmp_path: Path) -> None:
    corrections, reader = corrections_of(Recording(), tmp_path)
    assert corrections.inputs == {} and not corrections.findings
    assert reader.base_from_laser_source == "assumed identity"


@pytest.mark.parametrize("share", [0.3048, 0.5, 1.3, 2.0])
def test_wheels_that_report_more_or_less_than_the_distance(tmp_path: Path, share: float) -> None:
    corrections, _ = corrections_of(Recording().multiply(share, share, 1.0), tmp_path)
    assert corrections.odometry_factors == pytest.approx((1.0 / share, 1.0 / share, 1.0), rel=0.03)
    assert only_finding(corrections) == "distances_disagree"
    assert corrections.findings[0].spoils_map == (share == 0.3048)


def test_wheels_whose_x_and_y_are_exchanged_are_not_used(tmp_path: Path) -> None:
    recording = Recording().change_odometry(
        lambda sample: replace(sample, odom_from_base=sample.odom_from_base[[1, 0, 2]])
    )
    corrections, _ = corrections_of(recording, tmp_path)
    assert not corrections.uses_odometry
    assert only_finding(corrections) == "odometry_mirrored"


def test_beams_turned_round_by_the_driver(tmp_path: Path) -> None:
    recording = Recording()
    recording.scans = [
        replace(scan, bearings=-scan.bearings[::-1], ranges=scan.ranges[::-1]) for scan in recording.scans
    ]
    mirrored = recording.multiply(1.0, -1.0, -1.0)  # the same drive in a mirror
    corrections, _ = corrections_of(mirrored, tmp_path)
    assert corrections.inputs == {"corrections": {"beams": "reversed"}}
    assert only_finding(corrections) == "beams_reversed"


def test_a_laser_that_looks_backwards(tmp_path: Path) -> None:
    corrections, reader = corrections_of(Recording(BACKWARDS), tmp_path)
    assert corrections.base_from_laser == pytest.approx(BACKWARDS, abs=0.05)
    assert reader.base_from_laser is corrections.base_from_laser
    assert reader.base_from_laser_source == "motion"
    assert only_finding(corrections) == "place_learned"
    assert not any("taken to be at base_link" in warning for warning in reader.warnings)


def test_a_place_that_is_told_is_believed_and_not_the_wheels(tmp_path: Path) -> None:
    recording = Recording(BACKWARDS)
    recording.told = np.array([-0.2, 0.0, 0.0])
    corrections, reader = corrections_of(recording, tmp_path)
    assert corrections.base_from_laser is None and reader.odom_topic is None
    assert only_finding(corrections) == "place_contradicted"
    assert not any(isinstance(item, Odometry) for item in reader_items(tmp_path, corrections))


@pytest.mark.parametrize(
    ("source", "is_alone", "turned", "one_way", "finding"),
    [
        ("tf", True, 14.0, 0.3, "place_turned"),
        ("tf", True, -90.0, 0.3, "place_turned"),
        ("tf", True, 180.0, 0.3, "place_contradicted"),
        ("tf", True, 14.0, 0.9, None),
        ("tf", True, 20.0, 0.9, "place_contradicted"),
        ("tf", False, 14.0, 0.3, "place_contradicted"),
        ("flag", True, 14.0, 0.3, "place_contradicted"),
    ],
)
def test_a_transform_yields_to_wheels_that_drive_hither_and_thither_along_their_axis(
    source: str, is_alone: bool, turned: float, one_way: float, finding: str | None
) -> None:
    told, shown = np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, np.radians(turned)])
    mount = MountEstimate(shown, np.full(3, 0.005), 1.0, 0.02, 1.0, 0.01, sideways=0.02, one_way=one_way)
    learned = SelfCalibration(
        turns=TurnAgreement(0, 1.0, 0.01, 0.1), reading=MotionReading(mount, WheelSigns.AS_RECORDED)
    )
    known = KnownSensors("/scan", "/odom", told, source, (None, None), is_upside_down=True, is_alone=is_alone)
    made = learned_corrections(learned, known)
    assert [each.name for each in made.findings] == ([] if finding is None else [finding])
    assert made.uses_odometry == (finding != "place_contradicted")
    if finding == "place_turned":
        assert made.base_from_laser == pytest.approx([0.1, 0.0, np.radians(turned)])
        assert made.findings[0].remedy.endswith("3.142'.")


def reader_items(folder: Path, corrections: Corrections) -> list[Scan | Odometry]:
    with BagReader(folder / "bag") as reader:
        reader.correct(corrections)
        return list(reader)


def test_a_place_that_is_told_rightly_is_no_finding(tmp_path: Path) -> None:
    recording = Recording(BACKWARDS)
    recording.told = BACKWARDS
    corrections, _ = corrections_of(recording, tmp_path)
    assert corrections.inputs == {} and not corrections.findings


def upside_down(recording: Recording) -> Recording:
    """The laser counts its bearings clockwise, and measures them in that order."""
    recording.scans = [
        replace(scan, bearings=-scan.bearings[::-1], ranges=scan.ranges[::-1], time_offsets=scan.time_offsets)
        for scan in scans_of(DRIVE * [1.0, 1.0, 1.0], SECONDS)
    ]
    return recording


def test_a_laser_upside_down(tmp_path: Path) -> None:
    corrections, _ = corrections_of(upside_down(Recording()), tmp_path)
    assert corrections.is_upside_down and corrections.base_from_laser is not None
    assert corrections.base_from_laser == pytest.approx([0.0, 0.0, 0.0], abs=0.05)
    assert any(finding.name == "laser_upside_down" for finding in corrections.findings)


def test_wheels_and_gyroscope_together_outweigh_the_transform(tmp_path: Path) -> None:
    recording = upside_down(Recording())
    recording.told = IDENTITY
    recording.yaw_rates = turning(1.0, 0.0)
    corrections, reader = corrections_of(recording, tmp_path)
    assert corrections.is_upside_down and reader.laser_is_upside_down
    assert corrections.uses_odometry and corrections.odometry_factors == (1.0, 1.0, 1.0)
    assert any(finding.name == "laser_hangs_otherwise" for finding in corrections.findings)
    laser = next(item for item in reader_items(tmp_path, corrections) if isinstance(item, Scan))
    right = scans_of(DRIVE, SECONDS)[0]
    assert np.interp(0.5, laser.bearings, laser.ranges) == pytest.approx(
        np.interp(0.5, right.bearings, right.ranges), abs=0.1
    )


@pytest.mark.parametrize(
    ("source", "gyro", "is_outweighed"),
    [("tf", -1.0, True), ("flag", -1.0, False), ("tf", 1.0, False), ("tf", None, False)],
)
def test_a_flag_is_not_outweighed_nor_a_transform_by_wheels_alone(
    source: str, gyro: float | None, is_outweighed: bool
) -> None:
    learned = SelfCalibration(
        turns=TurnAgreement(0, -1.0, 0.01, 0.1),
        gyro_turns=None if gyro is None else TurnAgreement(0, gyro, 0.01, 0.1),
    )
    known = KnownSensors("/scan", "/odom", IDENTITY, source, (None, None), is_upside_down=True)
    made = learned_corrections(learned, known)
    assert made.is_upside_down == is_outweighed
    assert any(finding.name == "laser_hangs_otherwise" for finding in made.findings) == is_outweighed


@pytest.mark.parametrize("roll", [[], [np.pi]])
def test_the_flag_decides_what_hangs_upside_down(tmp_path: Path, roll: list[float]) -> None:
    given = np.array([0.0, 0.0, 0.0, *roll])
    corrections, _ = corrections_of(upside_down(Recording()), tmp_path, base_from_laser=given)
    assert not corrections.is_upside_down and corrections.base_from_laser is None
    assert corrections.odometry_factors == ((1.0, 1.0, 1.0) if roll else (1.0, -1.0, -1.0))


@pytest.mark.parametrize(
    ("factors", "read_as"), [((1, 1, -1), (1.0, 1.0, -1.0)), ((1, -1, -1), (1.0, -1.0, -1.0))]
)
def test_wheels_with_wrong_signs(
    tmp_path: Path, factors: tuple[int, ...], read_as: tuple[float, ...]
) -> None:
    recording = Recording().multiply(*factors)
    recording.told = IDENTITY
    corrections, _ = corrections_of(recording, tmp_path)
    assert corrections.odometry_factors == read_as
    assert only_finding(corrections) == "signs_changed"


@pytest.mark.parametrize("seconds", [-2.5, 0.9])
def test_a_clock_that_is_off(tmp_path: Path, seconds: float) -> None:
    late = round(seconds * 1e9)
    recording = Recording().change_odometry(
        lambda sample: replace(sample, stamp=sample.stamp + 10**10 + late)
    )
    recording.scans = [replace(scan, stamp=scan.stamp + 10**10) for scan in recording.scans]
    corrections, _ = corrections_of(recording, tmp_path)
    assert corrections.odometry_shift * 1e-9 == pytest.approx(-seconds, abs=0.05)
    assert only_finding(corrections) == "clocks_apart"
    assert corrections.findings[0].numbers["seconds"] == pytest.approx(abs(seconds), abs=0.05)


def test_odometry_in_degrees(tmp_path: Path) -> None:
    corrections, _ = corrections_of(Recording().multiply(1.0, 1.0, float(np.degrees(1.0))), tmp_path)
    assert not corrections.uses_odometry
    assert only_finding(corrections) == "odometry_impossible"


def test_wheels_without_turns_are_not_used_where_nothing_else_has_them(tmp_path: Path) -> None:
    recording = Recording().multiply(1.0, 1.0, 0.0)
    corrections, _ = corrections_of(recording, tmp_path)
    assert not corrections.uses_odometry
    assert only_finding(corrections) == "odometry_without_turns"


def test_odometry_that_is_stuck(tmp_path: Path) -> None:
    corrections, reader = corrections_of(Recording().multiply(0.0, 0.0, 0.0), tmp_path)
    assert not corrections.uses_odometry and reader.odom_topic is None
    assert only_finding(corrections) == "odometry_stuck"


def test_odometry_that_is_not_used_is_not_said_to_be_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    corrections, reader = corrections_of(Recording().multiply(0.0, 0.0, 0.0), tmp_path)
    assert only_finding(corrections) == "odometry_stuck"
    assert reader.tells_of_no_odometry  # so that nobody adds that there was none
    assert run(["check", str(tmp_path / "bag"), "--json", str(tmp_path / "check.json")]) == 0
    assert "on /odom, not used" in capsys.readouterr().out
    told = json.loads((tmp_path / "check.json").read_text())["odometry"]
    assert told == {"topic": "/odom", "is_used": False}


def test_without_odometry_and_beam_times_nothing_is_asked(tmp_path: Path) -> None:
    recording = Recording()
    recording.odometry = []
    recording.scans = [replace(scan, time_offsets=0.0 * scan.time_offsets) for scan in recording.scans]
    with BagReader(recording.write(tmp_path / "bag")) as reader:
        calibrate(reader, quiet=True)
        assert reader.messages_read < 100
        assert reader._corrections.inputs == {}


def told_half(recording: Recording) -> Recording:
    """Whose beams, of a whole turn, are stated to lie over half of it."""
    recording.scans = [
        replace(scan, bearings=-np.pi + 0.5 * (scan.bearings + np.pi)) for scan in recording.scans
    ]
    return recording


def test_beams_over_twice_the_angle_that_is_stated(tmp_path: Path) -> None:
    corrections, _ = corrections_of(told_half(Recording()), tmp_path)
    assert corrections.bearing_factor == pytest.approx(2.0, abs=1e-6)
    assert only_finding(corrections) == "bearings_scaled"
    scan = next(item for item in reader_items(tmp_path, corrections) if isinstance(item, Scan))
    assert np.diff(scan.bearings) == pytest.approx(2.0 * np.pi / 240, rel=1e-3) and len(scan.bearings) == 240


def test_without_wheels_walls_that_are_bent_are_told_only(tmp_path: Path) -> None:
    recording = told_half(Recording())
    recording.odometry = []
    corrections, _ = corrections_of(recording, tmp_path)
    assert corrections.bearing_factor == 1.0
    assert only_finding(corrections) == "bearings_doubtful" and corrections.findings[0].spoils_map


def turning(factor: float, lag: float) -> list[YawRate]:
    """The drive's gyroscope, stamped so late."""
    rates = np.gradient(DRIVE[:, 2], STEP)
    return [
        YawRate(round((STEP * index + lag) * 1e9), float(factor * rates[index]))
        for index in range(0, round(SECONDS / STEP), 2)
    ]


@pytest.mark.parametrize("has_wheels", [True, False])
def test_a_gyroscope_that_is_late_is_read_in_time(tmp_path: Path, has_wheels: bool) -> None:
    recording = Recording()
    recording.yaw_rates = turning(1.0, 0.3)
    if not has_wheels:
        recording.odometry = []
    corrections, _ = corrections_of(recording, tmp_path)
    assert corrections.yaw_rate_shift * 1e-9 == pytest.approx(-0.3, abs=0.03)
    assert only_finding(corrections) == "imu_lags"


@pytest.mark.parametrize(("factor", "told"), [(1.0, None), (-1.0, "other side"), (57.3, "reports degrees")])
def test_who_only_checks_hears_of_the_gyroscope_what_a_mapper_finds(
    tmp_path: Path, factor: float, told: str | None
) -> None:
    recording = Recording()
    recording.yaw_rates = turning(factor, 0.0)
    assert [told in finding.what for finding in foreseen_in(recording, tmp_path) if told] == [True] * bool(
        told
    )


def foreseen_in(recording: Recording, folder: Path) -> list[Finding]:
    recording.change_odometry(lambda sample: replace(sample, stamp=sample.stamp + 1_000_000_000))
    with BagReader(recording.write(folder / "bag")) as reader:
        foreseen = calibrate(reader, quiet=True)
        assert reader._corrections.inputs == {}
    return foreseen


@pytest.mark.parametrize("lag", [0.0, 0.2])
def test_who_only_checks_hears_of_a_lag_that_a_mapper_bears(tmp_path: Path, lag: float) -> None:
    recording = Recording()
    recording.odometry = odometry_of(DRIVE, SECONDS, lag)
    told = foreseen_in(recording, tmp_path)
    assert [finding.name for finding in told] == ["odometry_lags"] * (lag > 0.0)
    for finding in told:
        assert finding.numbers == {"milliseconds": pytest.approx(200, abs=10), "side": "behind"}
