import json
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.config_file import Config, load_config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.evaluation.evaluation import compare
from racecar.pipelines.runs.interrupts import STOP_SIGNALS
from racecar.pipelines.runs.map_outputs import MAP_FILES
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

BEARINGS = np.deg2rad(np.arange(-135.0, 135.0))


def scan_of_a_room(index: int) -> Scan:
    """From a car that drives 5 cm a scan along x, in the middle of a room of 10 × 6 m."""
    x = 0.05 * index
    with np.errstate(divide="ignore"):
        to_ends = np.where(np.cos(BEARINGS) > 0, 6.0 - x, -4.0 - x) / np.cos(BEARINGS)
        to_sides = 3.0 / np.abs(np.sin(BEARINGS))
    ranges = np.minimum(to_ends, to_sides)
    return Scan(index * 25_000_000, BEARINGS, ranges, np.zeros_like(ranges), np.zeros(3), 30.0)


class RoomReader:
    """Stands in for a bag; presses Ctrl-C after some scans."""

    path = Path("room")
    scan_topic = "/scan"
    inputs: dict[str, object] = {"scan_topic": "/scan"}  # noqa: RUF012
    counts: dict[str, int] = {}  # noqa: RUF012
    warnings = ["The bag is cut."]  # noqa: RUF012
    imu_topic = None
    tells_of_no_odometry = False
    messages_read = message_count = 0

    def __init__(
        self,
        scans: int,
        interrupt_after: int | None = None,
        odom_topic: str | None = None,
        by: signal.Signals = signal.SIGINT,
    ) -> None:
        self._by = by
        self.message_count = scans
        self.odom_topic = odom_topic
        self._interrupt_after = interrupt_after

    def require_returns(self) -> None:
        """It sees a room."""

    def __iter__(self) -> Iterator[Scan]:
        for index in range(1, self.message_count + 1):
            self.messages_read = index
            yield scan_of_a_room(index)
            if self.messages_read == self._interrupt_after:
                self._interrupt_after = None
                signal.raise_signal(self._by)


class LateScansReader(RoomReader):
    """A race car on the track, whose scans are stamped as much too late as it tells."""

    def __init__(self, late: int) -> None:
        super().__init__(0, odom_topic="/odom")
        track = load_map(shipped_map("track"))
        self.simulation = Simulation(track, SimulationConfig(seed=2, duration=20.0, max_speed=4.0))
        self._late = late

    def __iter__(self) -> Iterator[Scan | Odometry]:
        scans = 0
        for message in self.simulation.messages():
            if isinstance(message, Odometry):
                yield message
                continue
            scans += 1
            if scans % 4 == 0:
                yield replace(message, stamp=message.stamp + self._late)


class CarriedReader(RoomReader):
    """Somebody walks along 0.32 m from the laser, on the left."""

    def __iter__(self) -> Iterator[Any]:
        for scan in super().__iter__():
            yield Odometry(scan.stamp, np.array([0.002 * scan.stamp * 1e-6, 0.0, 0.0]), np.zeros(3))
            yield replace(scan, ranges=np.where(np.abs(BEARINGS - np.pi / 3.0) < 0.26, 0.32, scan.ranges))


def build(reader: Any, report: Report) -> Any:
    context = RunContext(report, stop_signals=STOP_SIGNALS)
    return build_map(reader, Config(), context, learns_sensors=False)


def test_bag_becomes_files_and_report(tmp_path: Path) -> None:
    report = Report("racecar map")
    result = build(RoomReader(40), report)
    result.save(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(MAP_FILES)
    np.testing.assert_allclose(result.trajectory.map_from_base[-1], [0.05 * 39, 0, 0], atol=0.02)
    written = json.loads((tmp_path / "report.json").read_text())
    assert written["counts"]["scans"] == 40
    assert written["result"]["path_metres"] == pytest.approx(0.05 * 39, abs=0.3)
    assert written["inputs"]["scan_topic"] == "/scan"
    assert "The bag is cut." in written["warnings"]
    assert any("odometry" in sentence for sentence in written["warnings"])
    assert {"reading", "scan matching", "optimizing", "writing"} <= written["stages"].keys()


def test_what_moves_along_is_left_out_of_the_map_and_told() -> None:
    report = Report("racecar map")
    result = build(CarriedReader(100, odom_topic="/odom"), report)
    np.testing.assert_allclose(result.trajectory.map_from_base[-1], [0.05 * 99, 0, 0], atol=0.02)
    left_out = report.as_dict()["moving_along"]
    assert left_out["share"] == pytest.approx(30.0 / 270.0, abs=0.01)
    assert left_out["sectors"] == [
        {"begin": 45.0, "end": 75.0, "nearest": pytest.approx(0.3), "farthest": pytest.approx(0.35)}
    ]
    (told,) = [sentence for sentence in report.warnings if "move along" in sentence]
    assert "11% of the returns between 0 and 2 s" in told
    assert "45° to 75°, 0.3 to 0.4 m" in told


@pytest.mark.parametrize("is_told", [False, True])
def test_that_there_is_no_odometry_is_told_once(is_told: bool) -> None:
    reader, report = RoomReader(5), Report("racecar map")
    reader.tells_of_no_odometry = is_told
    build(reader, report)
    assert any("No wheel odometry" in sentence for sentence in report.warnings) != is_told


@pytest.mark.parametrize("odom_topic", [None, "/odom"])
def test_interrupt_makes_a_map_of_what_was_read(odom_topic: str | None) -> None:
    """With an odometry topic it comes while clocks are compared."""
    report = Report("racecar map")
    result = build(RoomReader(40, interrupt_after=20, odom_topic=odom_topic), report)
    assert 20 <= len(result.trajectory) <= 21
    assert any("Ctrl-C" in sentence for sentence in report.warnings)
    assert report.as_dict()["counts"]["interrupted"] is True


def test_so_does_whoever_ends_processes() -> None:
    report = Report("racecar map")
    result = build(RoomReader(40, interrupt_after=20, by=signal.SIGTERM), report)
    assert 20 <= len(result.trajectory) <= 21
    assert any("The reading was stopped after 2" in sentence for sentence in report.warnings)


def test_comparing_clocks_changes_nothing_where_they_agree() -> None:
    results = [build(RoomReader(40, odom_topic=topic), Report("racecar map")) for topic in (None, "/odom")]
    expected, result = (result.trajectory.map_from_base for result in results)
    np.testing.assert_array_equal(result, expected)


def test_scans_stamped_late_are_mapped_from_the_first_on_as_if_they_were_not() -> None:
    late = 130_000_000  # between two of the lags that are tried
    reader, report = LateScansReader(late), Report("racecar map")
    result = build(reader, report)
    truth = reader.simulation.ground_truth
    at_scans = Trajectory(result.trajectory.stamps - late, result.trajectory.map_from_base)
    errors = compare(at_scans, truth).positions
    assert errors.mean() < 0.012
    assert errors.max() < 0.05
    assert any("odometry is" in sentence and "ahead of the scans" in sentence for sentence in report.warnings)


def test_no_scan() -> None:
    with pytest.raises(UserError, match="no usable scan on /scan"):
        build(RoomReader(0), Report("racecar map"))


@pytest.mark.parametrize(("resolution", "is_told"), [(0.2, False), (1.0, True)])
def test_a_coarse_map_is_told(resolution: float, is_told: bool) -> None:
    report, config = Report("racecar map"), load_config({"mapping": {"resolution": resolution}})
    build_map(cast(Any, RoomReader(5)), config, RunContext(report), learns_sensors=False)
    assert any("cells are 1 m wide" in sentence for sentence in report.warnings) == is_told
