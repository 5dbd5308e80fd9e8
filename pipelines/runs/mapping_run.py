"""Map a bag: ``racecar.map_bag`` of Python, and the command ``racecar map``."""

import gc
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from racecar.mapping.mapper import Mapper
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.session import has_recording_of
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.mapping.state.result import WITHOUT_WHEELS
from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.given_arrays import as_pose
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.config_file import Config, ConfigSource, load_config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.bag_reading import BagReading, opened_bag
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.corrected_session import CorrectedSession, load_corrected
from racecar.pipelines.runs.error_sentences import TO_BE_RECOGNIZED
from racecar.pipelines.runs.interrupts import StopRequest, stop_request
from racecar.pipelines.runs.map_cautions import cautions_of_fixed_returns, cautions_of_resolution
from racecar.pipelines.runs.map_run import MapRun, extending, finish_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.runs.run_digest import run_digest
from racecar.sensors.fixed_returns.fixed_returns import FixedReturns
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_FIRST_TURNS, _ROUNDS = 5000, 3
"""Messages searched for turns, about a minute of driving since a car may stand for long at first; and maximum
restarts, since the learned lag hardly changes after the second one."""


@checked
def map_bag(
    bag: str | Path | BagReader,
    *,
    config: ConfigSource = None,
    scan_topic: str | Sequence[str] | None = None,
    odom_topic: str | None = None,
    imu_topic: str | None = None,
    use_odometry: bool = True,
    use_imu: bool = True,
    laser_pose: ArrayLike | None = None,
    start: float = 0.0,
    duration: float | None = None,
    continued: str | Path | None = None,
    initial_pose: ArrayLike | None = None,
    quiet: bool = True,
) -> MapRun:
    """Build a map of a bag, as ``racecar map`` does.

    ``bag`` is a path, which is read with the options of `BagReader`, or a `BagReader` that is open.
    ``config`` is a YAML file of settings, its contents, such as ``{"mapping": {"resolution": 0.1}}``, or a
    `Config`. ``laser_pose`` (3,) is the laser's place on the car, in metres and radians; (4,) with a roll.
    ``continued`` is the folder of an earlier map to extend. The drive starts on it at the ``initial_pose``
    (3,), x and y in metres and yaw in radians; without one, the whole map is searched. Unless ``quiet``, a
    terminal shows the progress.

    Raises UserError, which states the fault and the remedy in one sentence.
    """
    context = RunContext(Report("racecar.map_bag"), quiet=quiet)
    settings, folder = load_config(config), None if continued is None else Path(continued)
    reading = BagReading(
        scan_topic, odom_topic, imu_topic, use_odometry, use_imu, laser_pose, start, duration
    )
    with opened_bag(bag, settings.sensors, reading) as reader:
        file = config if isinstance(config, str | Path) else None
        context.report.add("inputs", {"bag": reader.path, "config": file})
        return build_map(
            reader,
            settings,
            context,
            reading=None if isinstance(bag, BagReader) else reading,
            continued=folder,
            initial_pose=None if initial_pose is None else as_pose(initial_pose, "The initial pose").tolist(),
        )


def build_map(
    reader: BagReader,
    config: Config,
    context: RunContext,
    *,
    reading: BagReading | None = None,
    continued: Path | None = None,
    initial_pose: Sequence[float] | None = None,
    learns_sensors: bool = True,
    keep_clouds: bool = False,
) -> MapRun:
    """Run the mapper on an open bag; figures and warnings go into the report, and with the ``reading``, by
    which the bag was opened, a digest of the run.

    The map in the folder ``continued`` is extended; the drive starts on it at the ``initial_pose`` (3,) or
    anywhere. If ``learns_sensors``, the sensors are calibrated from the beginning of the bag. If
    ``keep_clouds``, the result has the clouds of a sensor with many rows. The context's
    watcher sees every scan, and the first ones again from another mapper if the run restarts. A second Ctrl-C
    raises KeyboardInterrupt. Raises UserError when the bag holds no usable scan, and when the drive is not
    recognized on the earlier map.
    """
    report, mapping = context.report, config.mapping
    report.add("inputs", {"settings": mapping.model_dump()})
    if reading is not None:
        digest = run_digest(reader.fingerprint, config, reading, continued, initial_pose)
        report.add("inputs", {"run_digest": digest})
    known = None if continued is None else load_corrected(continued, context)
    earlier = _earlier_map(reader, config, report, known, initial_pose)
    if learns_sensors:
        with report.stage("self-calibration"):
            calibrate(reader, context)
    fixed_returns, scans = FixedReturns(), 0
    with stop_request(*context.stop_signals) as stop, stop.looked_for():
        new_mapper = partial(Mapper, mapping, keep_clouds=keep_clouds)
        mapper, taken = _compare_clocks(reader, new_mapper, context, stop)
        gc.freeze()  # the loaded libraries stay: scanning them again would take a twentieth of the time
        with context.progress("Reading", reader.message_count) as advance_to:
            for message in _mapped(reader, mapper, fixed_returns, context, stop, taken):
                scans += isinstance(message, Scan)
                advance_to(reader.messages_read)
    if not scans:
        raise UserError(
            f"There is no usable scan on {reader.scan_topic}; `racecar check` shows what the bag holds."
        )
    if stop.is_made:
        report.add("counts", {"interrupted": True})
        report.warn(f"The reading was stopped after {scans} scans ({stop.source}); the map shows these.")
    reader.require_returns()
    report.add("inputs", reader.inputs)
    report.add("counts", {"messages": reader.counts})
    for sentence in reader.warnings:
        report.warn(sentence)
    told = [WITHOUT_WHEELS] if reader.tells_of_no_odometry else []
    try:
        run = finish_map(mapper, context, reader.path.name, earlier, told)
    except NotRecognizedError as error:
        raise UserError(f"{error}; {_remedy(is_start_given=initial_pose is not None)}") from error
    drive = run.session.only(run.session.times.are_of_last)
    if known is not None and has_recording_of(known.session, drive):
        report.warn(
            f"{known.folder} is of this recording already, which now counts twice: extend it by another "
            "drive."
        )
    if reader.imu_topic is not None:
        report.add("gyroscope", mapper.turn_model.figures)
    if (left_out := fixed_returns.left_out).returns:
        report.add("moving_along", left_out.as_dict())
    for sentence in [*cautions_of_fixed_returns(left_out), *cautions_of_resolution(mapping.resolution)]:
        report.warn(sentence)
    return run if known is None else extending(run, known)


def _earlier_map(
    reader: BagReader,
    config: Config,
    report: Report,
    continued: CorrectedSession | None,
    initial_pose: Sequence[float] | None,
) -> EarlierMap | None:
    """The map to extend, if there is one."""
    if continued is None:
        if initial_pose is not None:
            raise UserError(
                "An initial pose is a place on the earlier map that a drive continues; give both, or neither."
            )
        return None
    folder = continued.folder
    report.add("inputs", {"continue": folder, "initial_pose": initial_pose})
    start = None if initial_pose is None else np.array(initial_pose, dtype=np.float64)
    return EarlierMap(continued.session, start)


def _remedy(*, is_start_given: bool) -> str:
    """What would help to recognize a drive on a map."""
    if is_start_given:
        return (
            "see that the initial pose is where it begins, in the frame of the earlier map, or leave it out "
            "to search all of that map."
        )
    return f"{TO_BE_RECOGNIZED}, or map it on its own."


def _compare_clocks(
    reader: BagReader, new_mapper: Callable[[int], Mapper], context: RunContext, stop: StopRequest
) -> tuple[Mapper, int]:
    """A mapper made with the odometry's lag, learned from the first turns; and the number of messages it has
    processed.

    A mapper learns the lag by itself, but until then it has placed skewed scans, from which slightly less
    than the full lag is learned. It therefore restarts until the lag it learns is the one it started with.
    """
    lag = 0
    for _ in range(_ROUNDS if reader.odom_topic else 0):
        mapper, taken = new_mapper(lag), 0
        with context.progress("Comparing clocks", _FIRST_TURNS) as advance_to:
            messages = _mapped(reader, mapper, FixedReturns(), context, stop)
            for taken, _message in enumerate(islice(messages, _FIRST_TURNS), start=1):
                advance_to(taken)
                if mapper.odometry_lag.is_settled:
                    break
        if mapper.odometry_lag.nanoseconds == lag or stop.is_made:
            return mapper, taken
        lag = mapper.odometry_lag.nanoseconds
    return new_mapper(lag), 0


def _mapped(
    reader: BagReader,
    mapper: Mapper,
    fixed_returns: FixedReturns,
    context: RunContext,
    stop: StopRequest,
    taken: int = 0,
) -> Iterator[Measurement]:
    """Read until the end or a stop, and feed the mapper everything after the first messages, of which it has
    ``taken`` some already; yields each measurement read."""
    messages, number = fixed_returns.filtered(_until(stop, reader, taken)), 0
    while True:
        with context.report.stage("reading"):
            message = next(messages, None)
        if message is None:
            return
        number += 1
        if number > taken:
            with context.report.stage("scan matching"):
                map_from_base = feed(message, mapper)
            if isinstance(message, Scan) and map_from_base is not None:
                context.watch(mapper, message, map_from_base)
        yield message


def _until(stop: StopRequest, reader: BagReader, least: int) -> Iterator[Measurement]:
    """Measurements until the end or a stop, but at ``least`` this many."""
    for number, message in enumerate(reader, start=1):
        yield message
        if stop.is_made and number >= least:
            return
