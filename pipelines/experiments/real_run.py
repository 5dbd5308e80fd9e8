"""A drive without ground truth: other measures of how well the car was localized."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.warm_up import warm_up
from racecar.maps.geometry.se2 import transform_points
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.filters import Estimate, Track, heading_errors, place_errors, track
from racecar.pipelines.experiments.page import (
    Page,
    height_of_map,
    show_plain_ticks,
)
from racecar.pipelines.experiments.recording import Recording, stand_in
from racecar.pipelines.files.pictures.colors import BLUE, GREEN, PURPLE, VERMILLION
from racecar.pipelines.files.pictures.driven_time import DrivenTime
from racecar.pipelines.files.pictures.grid_drawing import draw_grid
from racecar.pipelines.files.pictures.moments import Moment, MomentsAlong
from racecar.pipelines.files.pictures.overlay import draw_scan, number_moments, titles_of
from racecar.pipelines.runs.evaluation.wall_fit import ON_WALL, WallFit
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.sensors.scan import Scan

_MOMENTS = 4
_STAND_IN_SECONDS, _QUICK_STAND_IN_SECONDS = 40.0, 15.0
_VIEW = 6.0
"""Metres from the car to the edge of a panel."""


@dataclass(frozen=True, eq=False)
class LocalizedRecording:
    """The filter's results on a recording."""

    recording: Recording
    run: Track
    path_metres: float
    shares_on_wall: NDArray[np.float64]
    """(S,) share of the end points within 10 cm of a wall, nan for scans without any."""
    moments: Sequence[Moment]
    """The scan that fits worst, and others along the path."""


def real_run(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """Localize on a recording, from its start pose if that is known, else globally.

    Without a recording a simulated drive is used.
    """
    seconds = _QUICK_STAND_IN_SECONDS if settings.quick else _STAND_IN_SECONDS
    recording = settings.recording or stand_in(settings.seed, seconds)
    return seen(localized(recording, settings, parallel))


def localized(
    recording: Recording, settings: ExperimentSettings, parallel: ParallelRuns
) -> LocalizedRecording:
    """Run the filter on a recording."""
    warm_up(settings.localization)
    localizer = Localizer(recording.grid, settings.localization, np.random.default_rng([settings.seed, 7]))
    if recording.start is not None:
        localizer.set_pose(recording.start)
    walls, judge, moments = WallFit(recording.grid), DriveJudge(), MomentsAlong(_MOMENTS)
    shares: list[float] = []

    def watch(scan: Scan, estimate: Estimate) -> None:
        assert isinstance(estimate, PoseEstimate)
        judge.follow(estimate)
        points = transform_points(estimate.map_from_base, scan.points_in_base())
        shares.append(walls.share_of_points(points))
        moment = Moment(scan.stamp, estimate.map_from_base, points, shares[-1])
        moments.add(judge.path_metres, moment, is_known=estimate.is_place_known)

    run = parallel.here.run("Real run", track, [(localizer, recording.messages(), watch)])[0]
    return LocalizedRecording(recording, run, judge.path_metres, np.array(shares), moments.moments)


def seen(found: LocalizedRecording) -> Page:
    """The page for a run."""
    recording, run, last = found.recording, found.run, found.run.map_from_base[-1]
    page = Page("A run without truth", _what_was_seen(found))
    page.figures |= {
        "recording": recording.title,
        "is_real": recording.is_real,
        "scans": len(run.stamps),
        "path_metres": found.path_metres,
        "seconds": run.seconds,
        "map_from_base": run.map_from_base,
        "shares_on_wall": found.shares_on_wall,
        "extents_m": run.extents,
        "deviations_m": run.deviations,
        "effective_sample_sizes": run.effective_sizes,
        "end_pose": last,
    }
    rows = _rows(found)
    if recording.end is not None:
        end = np.array([*recording.end, 0.0][:3])
        place = float(place_errors(last[None], end[None])[0])
        heading = float(heading_errors(last[None], end[None])[0])
        page.figures |= {"end_error_m": place, "end_heading_error_deg": heading}
        rows.append(("end pose against the tape measure (cm)", f"{100 * place:.1f}"))
        turned = ""
        if len(recording.end) == 3:
            rows.append(("end heading against the tape measure (°)", f"{heading:.2f}"))
            turned = f" and {heading:.1f}°"
        page.text.append(
            f"At the end the filter says ({last[0]:.2f}, {last[1]:.2f}) m; measured was "
            f"({end[0]:.2f}, {end[1]:.2f}) m: {100 * place:.1f} cm{turned} apart."
        )
    page.figures["measured_times"] = {"update_ms": 1e3 * run.update_seconds}
    page.table("The run in figures", ("figure", "value"), rows)
    _draw_path(page, found)
    _draw_overlays(page, found)
    _draw_over_time(page, found)
    return page


def _what_was_seen(found: LocalizedRecording) -> str:
    title = found.recording.title
    what = (
        f"The recording is {title}."
        if found.recording.is_real
        else f"No recording was given, so {title} stands in for one; its truth is used only for the end pose."
    )
    return (
        f"{what} Over {len(found.run.stamps)} scans and {found.path_metres:.1f} m of path, "
        f"{np.nanmean(found.shares_on_wall):.0%} of the "
        f"scans' end points lie within {100 * ON_WALL:.0f} cm of a wall of the map. The rest are people "
        "and things that the map does not have, and errors of the pose. The effective sample size "
        "falls when few particles explain a scan; the extent grows while the scans leave the place "
        "open."
    )


def _rows(found: LocalizedRecording) -> list[tuple[str, str]]:
    run, shares, milliseconds = found.run, found.shares_on_wall, 1e3 * found.run.update_seconds
    return [
        ("scans", f"{len(run.stamps)}"),
        ("path (m)", f"{found.path_metres:.1f}"),
        ("end points on walls, mean", f"{np.nanmean(shares):.1%}"),
        ("end points on walls, worst tenth of scans", f"{np.nanquantile(shares, 0.1):.1%}"),
        ("extent of the particles, median (m)", f"{np.median(run.extents.max(axis=1)):.2f}"),
        ("standard deviation of the particles, median (m)", f"{np.median(run.deviations):.3f}"),
        ("effective sample size, median", f"{np.median(run.effective_sizes):.0f}"),
        ("latency, mean (ms)", f"{milliseconds.mean():.2f}"),
        ("latency, 99% of scans under (ms)", f"{np.quantile(milliseconds, 0.99):.2f}"),
    ]


def _draw_path(page: Page, found: LocalizedRecording) -> None:
    path, measured = found.run.map_from_base[:, :2], found.recording.end
    middle, reach = (path.max(axis=0) + path.min(axis=0)) / 2, np.ptp(path, axis=0) / 2 + 3.0
    reach = np.maximum(reach, reach.max() / 2)
    low, high = middle - reach, middle + reach
    shows = "The path on the map, with the moments of the next figure numbered."
    height = height_of_map(low, high, around_mm=20)
    with page.draw("real-run-path", height, shows, legend_columns=4) as figure:
        axes = figure.subplots()
        draw_grid(axes, found.recording.grid, low, high)
        axes.plot(*path.T, color=BLUE, linewidth=1.0, label="path")
        axes.plot(*path[0], "o", color=GREEN, linestyle="none", label="start")
        axes.plot(*path[-1], "s", color=VERMILLION, linestyle="none", label="end")
        if measured is not None:
            axes.plot(*measured[:2], "x", color=PURPLE, linestyle="none", label="end, measured")
        number_moments(axes, found.moments, size=6)
        axes.set(xlabel="x (m)", ylabel="y (m)")


def _draw_overlays(page: Page, found: LocalizedRecording) -> None:
    shows = (
        "The scan laid on the map from where the filter says the car is, when it fits worst and at other "
        "moments up to the end: where it covers the walls, the pose is right."
    )
    with page.draw("real-run-overlay", 104, shows, legend_columns=2) as figure:
        panels = figure.subplots(2, 2)
        titles = titles_of(found.moments, int(found.run.stamps[0]))
        for axes, moment, title in zip(panels.flat, found.moments, titles, strict=False):
            draw_scan(axes, found.recording.grid, moment, _VIEW)
            axes.set_title(title.replace(": ", ":\n"), fontsize=7)  # the panels are narrow
        for axes in panels.flat[len(found.moments) :]:  # if there were fewer scans
            axes.set_axis_off()
        for axes in panels[-1]:
            axes.set_xlabel("x (m)")
        for axes in panels[:, 0]:
            axes.set_ylabel("y (m)")
        panels[0, 0].plot([], [], ".", color=VERMILLION, label="end points of the scan")
        panels[0, 0].plot([], [], ">", color=BLUE, linestyle="none", label="car")


def _draw_over_time(page: Page, found: LocalizedRecording) -> None:
    run, time = found.run, DrivenTime(found.run.seconds)
    shows = (
        f"Over time: share of the scan's end points within {100 * ON_WALL:.0f} cm of a wall, extent of the "
        "particles, effective sample size, and how long an update took."
    )
    with page.draw("real-run-time", 130, shows, legend_columns=2) as figure:
        walls, extent, size, latency = panels = figure.subplots(4, 1, sharex=True)
        for axes, values, color, label in (
            (walls, 100 * found.shares_on_wall, BLUE, None),
            (extent, run.extents[:, 0], BLUE, "extent in x"),
            (extent, run.extents[:, 1], VERMILLION, "extent in y"),
            (size, run.effective_sizes, BLUE, None),
            (latency, 1e3 * run.update_seconds, BLUE, None),
        ):
            axes.plot(*time.line(run.seconds, values), color=color, linewidth=0.7, label=label)
        walls.set(ylabel="end points\non walls (%)", ylim=(0, 103))
        extent.set(ylabel="particles'\nextent (m)", yscale="log")
        size.set(ylabel="effective\nsample size", yscale="log")
        latency.set(ylabel="latency (ms)", yscale="log")
        time.mark(*panels)
        for axes in panels[1:]:
            show_plain_ticks(axes.yaxis)
        figure.align_ylabels()
