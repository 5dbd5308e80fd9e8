import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.pipelines.bags.converters.scan_reading import Angles
from racecar.pipelines.bags.messages import LASER_SCAN
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.commands.cli import run
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.run_context import RunContext
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
from tests.sensors.drives import STEP, odometry_of, scans_of, winding_drive

SECONDS = 16.0
DRIVE = winding_drive(SECONDS)
BACKWARDS = np.array([-0.2, 0.0, np.pi])


class Recording:
    """A robot's drive, to be spoiled in one way or another."""

    def __init__(self, base_from_laser: Pose = IDENTITY, told: Pose | None = None) -> None:
        self.scans = scans_of(compose(DRIVE, base_from_laser), SECONDS)
        self.odometry = odometry_of(DRIVE, SECONDS)
        self.yaw_rates: list[YawRate] = []
        self.told = told
        self.told_before: list[Pose] = []

    def change_odometry(self, change: Callable[[Odometry], Odometry]) -> "Recording":
        self.odometry = [change(sample) for sample in self.odometry]
        return self

    def multiply(self, *factors: float) -> "Recording":
        return self.change_odometry(
            lambda sample: replace(sample, odom_from_base=sample.odom_from_base * np.array(factors))
        )

    def change_scans(self, change: Callable[[Scan], Scan]) -> "Recording":
        self.scans = [change(scan) for scan in self.scans]
        return self

    def without_odometry(self) -> "Recording":
        self.odometry = []
        return self

    def with_gyroscope(self, factor: float, lag: float = 0.0) -> "Recording":
        """Stamped so late."""
        rates = np.gradient(DRIVE[:, 2], STEP)
        self.yaw_rates = [
            YawRate(round((STEP * index + lag) * 1e9), float(factor * rates[index]))
            for index in range(0, round(SECONDS / STEP), 2)
        ]
        return self

    def write(self, path: Path) -> Path:
        with BagWriter(path) as writer:
            for place in self.told_before:
                writer.write_static_transform(place)
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
        calibrate(reader, RunContext())
        return reader._corrections, reader


def only_finding(corrections: Corrections) -> str:
    (finding,) = corrections.findings
    return finding.name


def late(seconds: float) -> Recording:
    """Of odometry whose clock is off."""
    recording = Recording().change_scans(lambda scan: replace(scan, stamp=scan.stamp + 10**10))
    by = 10**10 + round(seconds * 1e9)
    return recording.change_odometry(lambda sample: replace(sample, stamp=sample.stamp + by))


def mirrored() -> Recording:
    """The same drive in a mirror, of beams that the driver turned round."""
    recording = Recording().change_scans(
        lambda scan: replace(scan, bearings=-scan.bearings[::-1], ranges=scan.ranges[::-1])
    )
    return recording.multiply(1.0, -1.0, -1.0)


def told_half() -> Recording:
    """Whose beams, of a whole turn, are stated to lie over half of it."""
    return Recording().change_scans(
        lambda scan: replace(scan, bearings=-np.pi + 0.5 * (scan.bearings + np.pi))
    )


def exchanged() -> Recording:
    return Recording().change_odometry(
        lambda sample: replace(sample, odom_from_base=sample.odom_from_base[[1, 0, 2]])
    )


DEGREES = float(np.degrees(1.0))


@pytest.mark.parametrize(
    ("recording", "finding", "learned"),
    [
        (Recording, None, {"inputs": {}}),
        (lambda: Recording(BACKWARDS, BACKWARDS), None, {"inputs": {}}),
        *(
            (
                lambda share=share: Recording().multiply(share, share, 1.0),
                "distances_disagree",
                {"odometry_factors": pytest.approx((1.0 / share, 1.0 / share, 1.0), rel=0.03)},
            )
            for share in (0.3048, 0.5, 1.3, 2.0)
        ),
        *(
            (
                lambda signs=signs: Recording(told=IDENTITY).multiply(*signs),
                "signs_changed",
                {"odometry_factors": signs},
            )
            for signs in ((1.0, 1.0, -1.0), (1.0, -1.0, -1.0))
        ),
        *(
            (
                lambda seconds=seconds: late(seconds),
                "clocks_apart",
                {"odometry_shift": pytest.approx(-seconds * 1e9, abs=0.05e9)},
            )
            for seconds in (-2.5, 0.9)
        ),
        (exchanged, "odometry_mirrored", {"uses_odometry": False}),
        (lambda: Recording().multiply(1.0, 1.0, DEGREES), "odometry_impossible", {"uses_odometry": False}),
        (lambda: Recording().multiply(1.0, 1.0, 0.0), "odometry_without_turns", {"uses_odometry": False}),
        (lambda: Recording().multiply(0.0, 0.0, 0.0), "odometry_stuck", {"uses_odometry": False}),
        (mirrored, "beams_reversed", {"inputs": {"corrections": {"beams": "reversed"}}}),
        (told_half, "bearings_scaled", {"bearing_factor": pytest.approx(2.0, abs=1e-6)}),
        (lambda: told_half().without_odometry(), "bearings_doubtful", {"bearing_factor": 1.0}),
        (
            lambda: Recording().with_gyroscope(1.0, 0.3),
            "imu_lags",
            {"yaw_rate_shift": pytest.approx(-0.3e9, abs=0.03e9)},
        ),
        (
            lambda: Recording().with_gyroscope(1.0, 0.3).without_odometry(),
            "imu_lags",
            {"yaw_rate_shift": pytest.approx(-0.3e9, abs=0.03e9)},
        ),
    ],
)
def test_what_a_recording_proves_is_corrected_and_named(
    tmp_path: Path, recording: Callable[[], Recording], finding: str | None, learned: dict[str, object]
) -> None:
    corrections, reader = corrections_of(recording(), tmp_path)
    assert [each.name for each in corrections.findings] == ([] if finding is None else [finding])
    assert {name: getattr(corrections, name) for name in learned} == learned
    for each in corrections.findings:
        if each.name in ("distances_disagree", "bearings_doubtful"):  # wheels in feet, walls that are bent
            assert each.spoils_map == (
                corrections.odometry_factors[0] > 3.0 or finding == "bearings_doubtful"
            )
        if each.name == "clocks_apart":
            assert each.numbers["seconds"] == pytest.approx(abs(corrections.odometry_shift * 1e-9), abs=0.05)
    if finding is None:
        assert reader.base_from_laser_source in ("assumed identity", "tf_static")


def test_a_laser_that_looks_backwards(tmp_path: Path) -> None:
    corrections, reader = corrections_of(Recording(BACKWARDS), tmp_path)
    assert corrections.base_from_laser == pytest.approx(BACKWARDS, abs=0.05)
    assert reader.base_from_laser is corrections.base_from_laser
    assert reader.base_from_laser_source == "motion"
    assert only_finding(corrections) == "place_learned"
    assert "place_unknown" not in {finding.name for finding in reader.findings}


def test_a_place_that_is_told_is_believed_and_not_the_wheels(tmp_path: Path) -> None:
    corrections, reader = corrections_of(Recording(BACKWARDS, np.array([-0.2, 0.0, 0.0])), tmp_path)
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
        ("given", True, 14.0, 0.3, "place_contradicted"),
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
        assert made.findings[0].remedy.endswith(" 3.142.")


def reader_items(folder: Path, corrections: Corrections) -> list[Scan | Odometry]:
    with BagReader(folder / "bag") as reader:
        reader.correct(corrections)
        return list(reader)


def upside_down(recording: Recording) -> Recording:
    """The laser counts its bearings clockwise, and measures them in that order."""
    return recording.change_scans(
        lambda scan: replace(scan, bearings=-scan.bearings[::-1], ranges=scan.ranges[::-1])
    )


def test_a_laser_upside_down(tmp_path: Path) -> None:
    corrections, _ = corrections_of(upside_down(Recording()), tmp_path)
    assert corrections.is_upside_down and corrections.base_from_laser is not None
    assert corrections.base_from_laser == pytest.approx([0.0, 0.0, 0.0], abs=0.05)
    assert any(finding.name == "laser_upside_down" for finding in corrections.findings)


def test_wheels_and_gyroscope_together_outweigh_the_transform(tmp_path: Path) -> None:
    recording = upside_down(Recording(told=IDENTITY)).with_gyroscope(1.0)
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
    [("tf", -1.0, True), ("given", -1.0, False), ("tf", 1.0, False), ("tf", None, False)],
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
    corrections, _ = corrections_of(upside_down(Recording()), tmp_path, laser_pose=given)
    assert not corrections.is_upside_down and corrections.base_from_laser is None
    assert corrections.odometry_factors == ((1.0, 1.0, 1.0) if roll else (1.0, -1.0, -1.0))


def test_odometry_that_is_not_used_is_not_said_to_be_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, reader = corrections_of(Recording().multiply(0.0, 0.0, 0.0), tmp_path)
    assert reader.tells_of_no_odometry  # so that nobody adds that there was none
    assert run(["check", str(tmp_path / "bag"), "--json", str(tmp_path / "check.json")]) == 0
    assert "on /odom, not used" in capsys.readouterr().out
    told = json.loads((tmp_path / "check.json").read_text())["odometry"]
    assert told == {"topic": "/odom", "is_used": False}


@pytest.mark.parametrize("has_speeds", [True, False])
def test_odometry_that_is_reset_again_and_again_is_read_by_its_speeds(
    tmp_path: Path, has_speeds: bool
) -> None:
    recording = Recording()
    poses = np.array([sample.odom_from_base for sample in recording.odometry])
    speeds = between(poses, np.roll(poses, -1, axis=0)) / (2 * STEP) * has_speeds
    recording.odometry = [
        replace(
            sample,
            odom_from_base=between(poses[index // 5 * 5], poses[index]) * (index % 5 > 0),
            twist=speeds[index - 1],
        )
        for index, sample in enumerate(recording.odometry)
    ]
    corrections, reader = corrections_of(recording, tmp_path)
    found = {finding.name for finding in reader.findings}
    assert ("odometry_resets_by_speeds" in found, "odometry_resets" in found) == (has_speeds, not has_speeds)
    assert corrections.uses_odometry == has_speeds
    with BagReader(tmp_path / "bag") as again:
        calibrate(again, RunContext())
        samples = [item for item in again if isinstance(item, Odometry)]
    if has_speeds:
        moved = between(samples[0].odom_from_base, samples[-1].odom_from_base)
        np.testing.assert_allclose(moved[:2], between(poses[0], poses[-1])[:2], atol=0.02)
    else:
        assert not samples


def test_without_odometry_and_beam_times_nothing_is_asked(tmp_path: Path) -> None:
    recording = Recording().without_odometry()
    recording.change_scans(lambda scan: replace(scan, time_offsets=0.0 * scan.time_offsets))
    with BagReader(recording.write(tmp_path / "bag")) as reader:
        calibrate(reader, RunContext())
        assert reader.messages_read < 100
        assert reader._corrections.inputs == {}


def test_beams_over_twice_the_angle_that_is_stated_are_read_so(tmp_path: Path) -> None:
    corrections, _ = corrections_of(told_half(), tmp_path)
    scan = next(item for item in reader_items(tmp_path, corrections) if isinstance(item, Scan))
    assert np.diff(scan.bearings) == pytest.approx(2.0 * np.pi / 240, rel=1e-3) and len(scan.bearings) == 240


@pytest.mark.parametrize(("factor", "told"), [(1.0, None), (-1.0, "other side"), (57.3, "reports degrees")])
def test_who_only_checks_hears_of_the_gyroscope_what_a_mapper_finds(
    tmp_path: Path, factor: float, told: str | None
) -> None:
    recording = Recording().with_gyroscope(factor)
    found = [
        (each.name, told in each.numbers["contradiction"])
        for each in foreseen_in(recording, tmp_path)
        if told
    ]
    assert found == [("gyroscope_contradicts", True)] * (told is not None)


def foreseen_in(recording: Recording, folder: Path) -> list[Finding]:
    recording.change_odometry(lambda sample: replace(sample, stamp=sample.stamp + 1_000_000_000))
    with BagReader(recording.write(folder / "bag")) as reader:
        foreseen = calibrate(reader, RunContext())
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


@pytest.mark.parametrize(
    ("beams", "reading"), [(slice(None), Angles.SPREAD), (slice(None, None, -1), Angles.FROM_LAST)]
)
def test_turns_show_where_beams_begin_whose_angles_contradict_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beams: slice, reading: Angles
) -> None:
    """They go up from angle_min to angle_max, and the increment down; the beams go one way or the other."""
    plain = BagWriter.write_message

    def contradicting(self: BagWriter, topic: str, kind: str, message: Any, stamp: int) -> None:
        if kind == LASER_SCAN:
            message.angle_increment = -message.angle_increment
            message.ranges = message.ranges[beams].copy()
        plain(self, topic, kind, message, stamp)

    monkeypatch.setattr(BagWriter, "write_message", contradicting)
    corrections, reader = corrections_of(Recording(told=IDENTITY), tmp_path)
    assert corrections.uses_odometry and corrections.base_from_laser is None
    (finding,) = [each for each in reader.findings if each.name == "angles_not_as_stated"]
    assert (finding.numbers["reading"], finding.spoils_map) == (reading.value, False)


@pytest.mark.parametrize("is_last_right", [True, False])
def test_of_two_places_the_one_that_the_motions_prove_is_used(tmp_path: Path, is_last_right: bool) -> None:
    right, wrong = np.array([0.2, 0.1, 0.0]), np.array([0.5, 0.1, 0.0])
    recording = Recording(right, right if is_last_right else wrong)
    recording.told_before = [wrong if is_last_right else right]
    corrections, reader = corrections_of(recording, tmp_path)
    np.testing.assert_allclose(reader.base_from_laser, right, atol=1e-9)
    assert corrections.uses_odometry
    name = "place_told_twice" if is_last_right else "place_of_two"
    assert [each.name for each in reader.findings] == [name]
