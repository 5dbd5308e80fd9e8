"""From a bag to a map and its files: what all that map a bag share."""

import gc
import signal
from collections.abc import Callable, Collection, Iterable, Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.unrecognized import NotRecognizedError
from racecar.mapping.state.result import WITHOUT_WHEELS, MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.interrupts import StopRequest, stop_request
from racecar.pipelines.runs.map_cautions import cautions_of_fixed_returns, cautions_of_resolution
from racecar.pipelines.runs.map_outputs import WrittenMap, write_outputs
from racecar.pipelines.runs.progress import progress_bar
from racecar.sensors.fixed_returns.fixed_returns import FixedReturns
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_FIRST_TURNS, _ROUNDS = 5000, 3
"""Messages in which turns are looked for, about a minute of driving as a car may stand for long at first; and
how often it begins again at most, since the lag that is learned hardly changes after the second time."""

OPTIMIZING = "Optimizing"
"""The progress of what comes after the reading, which no request to stop ends any more."""

_NO_EDITS = MapEdits()

Watch = Callable[[Mapper, Scan, Pose], None]
"""Called after each scan with the mapper, the scan, and the car's pose (3,) in the map as known then."""


def nobody_watches(_mapper: Mapper, _scan: Scan, _map_from_base: Pose) -> None:
    """Of a run that is not looked at."""


def build_map(
    reader: BagReader,
    config: MappingConfig,
    report: Report,
    *,
    quiet: bool,
    earlier: EarlierMap | None = None,
    watch: Watch = nobody_watches,
    stop_signals: Collection[signal.Signals] = (),
) -> MappingResult:
    """Feed a bag through the mapper; figures and warnings go into the report.

    With an ``earlier`` map that is carried on. Whoever wants to ``watch`` the map grow sees every scan of the
    reading, the first ones once more by another mapper where the run begins anew. The first of the
    ``stop_signals`` ends the reading and what was read becomes the map; a second Ctrl-C raises
    KeyboardInterrupt. Raises UserError when the bag holds no usable scan, and when the drive is not
    recognized on the earlier map.
    """
    with stop_request(*stop_signals) as stop, stop.looked_for():
        mapper, taken = _begin(reader, config, report, stop, watch, quiet=quiet)
        gc.freeze()  # the libraries are loaded: a twentieth of the time goes into looking through them again
        fixed_returns = FixedReturns()
        scans = _feed(mapper, taken, reader, fixed_returns, report, stop, watch, quiet=quiet)
    if not scans:
        raise UserError(
            f"There is no usable scan on {reader.scan_topic}; `racecar check` shows what the bag holds."
        )
    with report.stage("optimizing"), progress_bar(OPTIMIZING, quiet=quiet) as advance_to:
        try:
            reader.require_returns()
            result = mapper.finish(advance_to, earlier)
        except NotRecognizedError as error:
            if earlier is None:
                raise
            raise UserError(f"{error}; {_remedy(earlier)}") from error
    report.add("inputs", reader.inputs)
    report.add("counts", {**result.counts, "messages": reader.counts})
    report.add("result", _describe_result(result))
    report.add("mapping_seconds", result.seconds)
    report.add("consistency", _residuals(result))
    report.add("quality", result.quality.as_dict())
    if reader.imu_topic is not None:
        report.add("gyroscope", mapper.turn_model.figures)
    left_out = fixed_returns.left_out
    if left_out.returns:
        report.add("moving_along", left_out.as_dict())
    told = [WITHOUT_WHEELS] if reader.tells_of_no_odometry else []
    own = [sentence for sentence in result.warnings if sentence not in told]
    cautions = [*cautions_of_fixed_returns(left_out), *cautions_of_resolution(config.resolution)]
    for sentence in [*reader.warnings, *own, *cautions]:
        report.warn(sentence)
    return result


def save_mapping(
    result: MappingResult,
    report: Report,
    folder: Path,
    title: str,
    *,
    requested: Collection[str] = (),
    edits: MapEdits = _NO_EDITS,
) -> None:
    """Write every file of a mapping run into an existing folder, and those that were ``requested`` too.

    ``edits`` are in the frame of the map.
    """
    map_ = WrittenMap(
        session=result.session,
        grid=result.tiled,
        rendering=result.rendering,
        trajectory=result.trajectory,
        doubtful=result.quality.segments,
        caution=result.quality.caution,
        edits=edits,
        title=title,
        folder=folder,
    )
    write_outputs(map_, report, requested)


def finish_and_save(
    mapper: Mapper, report: Report, out: Path, earlier: EarlierMap | None = None
) -> MappingResult:
    """Finish the map of a drive that was mapped while it went on, and write every file of it; with an
    ``earlier`` map that is carried on.

    Raises UserError when there is no map or the folder cannot be written to, and NotRecognizedError when the
    drive is not recognized on the earlier map.
    """
    with output_folder(out) as folder:
        with report.stage("optimizing"):
            result = mapper.finish(earlier=earlier)
        report.add("counts", result.counts)
        report.add("mapping_seconds", result.seconds)
        report.add("quality", result.quality.as_dict())
        for sentence in result.warnings:
            report.warn(sentence)
        save_mapping(result, report, folder, title=out.name)
    return result


def _remedy(earlier: EarlierMap) -> str:
    """What would help a drive to be recognized on a map."""
    if earlier.is_start_given:
        return (
            "see that --initial-pose is where it begins, in the frame of the earlier map, or leave it out to "
            "search all of that map."
        )
    return (
        "if you know where on that map it begins, give --initial-pose X Y YAW; else record one that passes "
        "some 10 m of where an earlier drive went, or map it on its own."
    )


def _begin(
    reader: BagReader,
    config: MappingConfig,
    report: Report,
    stop: StopRequest,
    watch: Watch,
    *,
    quiet: bool,
) -> tuple[Mapper, int]:
    """A mapper of the first messages, with the odometry's lag that the first turns show; how many it took.

    The mapper learns it by itself, but has placed skewed scans until then, which lead to a little less than
    all of it; so it begins again until it learns what it knew.
    """
    lag = 0
    for _ in range(_ROUNDS if reader.odom_topic else 0):
        mapper, taken = Mapper(config, lag), 0
        with progress_bar("Comparing clocks", _FIRST_TURNS, quiet=quiet) as advance_to:
            messages = _timed(_until(stop, reader), FixedReturns(), report)
            for taken, message in enumerate(islice(messages, _FIRST_TURNS), start=1):
                _hand_on(message, mapper, report, watch)
                advance_to(taken)
                if mapper.odometry_lag.is_settled:
                    break
        if mapper.odometry_lag.nanoseconds == lag or stop.is_made:
            return mapper, taken
        lag = mapper.odometry_lag.nanoseconds
    return Mapper(config, lag), 0


def _feed(
    mapper: Mapper,
    taken: int,
    reader: BagReader,
    fixed_returns: FixedReturns,
    report: Report,
    stop: StopRequest,
    watch: Watch,
    *,
    quiet: bool,
) -> int:
    """Hand every message after those ``taken`` to the mapper; the number of scans, these included."""
    scans = 0
    with progress_bar("Reading", reader.message_count, quiet=quiet) as advance_to:
        messages = _timed(_until(stop, reader, taken), fixed_returns, report)
        for number, message in enumerate(messages, start=1):
            scans += isinstance(message, Scan)
            if number > taken:
                _hand_on(message, mapper, report, watch)
            advance_to(reader.messages_read)
    if stop.is_made:
        report.add("counts", {"interrupted": True})
        report.warn(f"The reading was stopped after {scans} scans ({stop.source}); the map shows these.")
    return scans


def _hand_on(message: Measurement, mapper: Mapper, report: Report, watch: Watch) -> None:
    with report.stage("scan matching"):
        map_from_base = feed(message, mapper)
    if isinstance(message, Scan) and map_from_base is not None:
        watch(mapper, message, map_from_base)


def _until(stop: StopRequest, reader: BagReader, least: int = 0) -> Iterator[Measurement]:
    """What is read until that is to end, at ``least`` so many messages."""
    for number, message in enumerate(reader, start=1):
        yield message
        if stop.is_made and number >= least:
            return


def _timed(read: Iterable[Measurement], fixed_returns: FixedReturns, report: Report) -> Iterator[Measurement]:
    messages = fixed_returns.filtered(read)
    while True:
        with report.stage("reading"):
            message = next(messages, None)
        if message is None:
            return
        yield message


def _describe_result(result: MappingResult) -> dict[str, object]:
    places = result.trajectory.map_from_base[result.keyframe_indices, :2]  # the scans between them jitter
    seconds = (result.trajectory.stamps[-1] - result.trajectory.stamps[0]) * 1e-9
    return {
        "log_seconds": seconds,
        "path_metres": np.sum(np.hypot(*np.diff(places, axis=0).T)),
        "map_metres": list(result.tiled.metres),
    }


def _residuals(result: MappingResult) -> dict[str, dict[str, float]]:
    """By kind of constraint: how many there are and how far, on average, the solution is from them."""
    keyframes = result.map_from_keyframe
    by_kind: dict[str, list[np.ndarray]] = {}
    for constraint in result.constraints:
        solved = between(keyframes[constraint.from_keyframe], keyframes[constraint.to_keyframe])
        by_kind.setdefault(constraint.kind, []).append(between(constraint.from_pose_to_pose, solved))
    summary = {}
    for kind, residuals in by_kind.items():
        dx, dy, turn = np.array(residuals).T
        summary[kind] = {
            "constraints": len(residuals),
            "mean_residual_m": float(np.mean(np.hypot(dx, dy))),
            "mean_residual_deg": float(np.mean(np.abs(np.rad2deg(turn)))),
        }
    return summary
