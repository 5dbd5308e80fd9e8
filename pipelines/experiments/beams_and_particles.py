"""The benefit and cost of beams and particles."""

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.warm_up import warm_up
from racecar.maps.geometry.se2 import between
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.filters import (
    Track,
    place_errors,
    simulated_drive,
    start_filter,
    sweep,
    track,
    with_particles,
)
from racecar.pipelines.experiments.page import MAP_OF_NUMBERS, Page, show_plain_ticks
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig

_BEAMS = (25, 50, 100, 200, 400)
_PARTICLES = (200, 500, 1000, 2000, 5000, 10_000, 20_000)
_MAP = "track"
_START = (0.1, 0.1, 0.05)
_TIMED_SCANS = 60


def beams_and_particles(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """All pairs, with 3 seeds for the accuracy; if quick, fewer pairs, one seed and a shorter drive."""
    beams = _BEAMS[::2] if settings.quick else _BEAMS
    particles = _PARTICLES[::3] if settings.quick else _PARTICLES
    seeds, seconds = (1, 6.0) if settings.quick else (3, 20.0)
    drive = SimulationConfig(noise=NoiseLevel.FULL, seed=1000 * settings.seed, duration=seconds)
    cases = {
        (beam_count, count): (with_particles(settings.localization, count, beams=beam_count), drive)
        for beam_count in beams
        for count in particles
    }
    runs = sweep(parallel, "Beams and particles", drive_errors, cases, seeds)
    warm_up(LocalizationConfig())
    times = parallel.here.run("Timing", milliseconds, list(cases.values()))
    shape = (len(beams), len(particles))
    figures = {
        "beams": beams,
        "particles": particles,
        **{
            figure: np.array([run[figure] for run in runs.values()]).reshape(*shape, seeds)
            for figure in ("errors_m", "leads_m", "scatters_m")
        },
        "measured_times": {"milliseconds_per_update": np.array(times).reshape(shape)},
    }
    return weighed_up(figures, settings.localization)


def weighed_up(figures: dict[str, Any], chosen: LocalizationConfig) -> Page:
    """The page for metres (beams, particles, seeds) and milliseconds (beams, particles), with the
    configuration in use for comparison."""
    errors, leads, scatters = (
        100 * figures[each].mean(axis=2) for each in ("errors_m", "leads_m", "scatters_m")
    )
    beams, particles, seeds = figures["beams"], figures["particles"], figures["errors_m"].shape[2]
    times = figures["measured_times"]["milliseconds_per_update"]
    best = np.unravel_index(np.argmin(errors), errors.shape)
    page = Page(
        "Beams and particles: accuracy against time",
        f"Drives of the shipped track with full odometry noise, {seeds} seed{'s' if seeds > 1 else ''}, the "
        "number of particles held fixed. The error is the mean distance to the truth over the drive; "
        "the time is the median of an update, measured one after the other with nothing beside it, so "
        "it depends on the machine and is not the same twice.",
        f"The smallest error, {errors[best]:.1f} cm, has {beams[best[0]]} beams and "
        f"{particles[best[1]]} particles at {times[best]:.1f} ms; the largest is "
        f"{errors.max():.1f} cm. The configuration in use has {chosen.beams} beams and at most "
        f"{chosen.particles} particles.",
        _what_more_beams_do(beams, leads.mean(axis=1), scatters.mean(axis=1)),
    )
    page.figures |= figures
    for name, values, shows, label, norm in (
        ("error", errors, "Mean distance to the truth in centimetres", "mean error (cm)", Normalize()),
        ("time", times, "Time of an update in milliseconds", "time of an update (ms)", LogNorm()),
    ):
        shows += ", for each number of beams and particles."
        _draw_heat_map(page, f"beams-and-particles-{name}", shows, values, label, norm)
    spreads = 100 * figures["errors_m"].std(axis=2)
    title = "Mean distance to the truth (cm), mean ± standard deviation over the seeds"
    _tabulate(page, title, errors, spreads)
    _tabulate(page, "Lead along the path (cm), mean ± scatter along the path", leads, scatters)
    _tabulate(page, "Time of an update (ms)", times)
    return page


def _what_more_beams_do(
    beams: tuple[int, ...], leads: NDArray[np.float64], scatters: NDArray[np.float64]
) -> str:
    """Why the error need not fall with more beams, from centimetres (beams,)."""
    return (
        f"From {beams[0]} to {beams[-1]} beams the scatter along the path goes from "
        f"{scatters[0]:.1f} to {scatters[-1]:.1f} cm, and the lead, by which the estimate is ahead of "
        f"the car on average, from {leads[0]:.1f} to {leads[-1]:.1f} cm. More beams average out chance, "
        "but not what all of them have in common, and the more of them count, the less the odometry "
        "holds against it. The lead does not grow with the speed, so it is no delay, and there is none "
        "to the side, where walls stand left and right: the laser sees walls ahead but not behind, so "
        "that what the expected ranges are off by does not cancel along the path."
    )


def _tabulate(page: Page, title: str, *values: NDArray[np.float64]) -> None:
    """Add a table of values (beams, particles), or of means and their standard deviations."""
    cells = [
        [" ± ".join(f"{each:.2f}" for each in cell) for cell in row] for row in np.stack(values, axis=-1)
    ]
    page.table(
        title,
        ("beams", *(f"{count} particles" for count in page.figures["particles"])),
        [(f"{count}", *row) for count, row in zip(page.figures["beams"], cells, strict=True)],
    )


def _draw_heat_map(
    page: Page,
    name: str,
    shows: str,
    values: NDArray[np.float64],
    label: str,
    norm: Normalize,
) -> None:
    particles, beams = page.figures["particles"], page.figures["beams"]
    with page.draw(name, 62, shows) as figure:
        axes = figure.subplots()
        image = axes.imshow(values, cmap=MAP_OF_NUMBERS, norm=norm, origin="lower", aspect="auto")
        for (row, column), value in np.ndenumerate(values):
            color = "black" if norm(value) > 0.5 else "white"
            axes.text(column, row, f"{value:.1f}", ha="center", va="center", color=color, fontsize=6)
        axes.set_xticks(range(len(particles)), [_short(count) for count in particles])
        axes.set_yticks(range(len(beams)), [f"{count}" for count in beams])
        axes.set(xlabel="particles", ylabel="beams")
        axes.grid(visible=False)
        bar = figure.colorbar(image, ax=axes, location="top", shrink=0.9)
        bar.set_label(label)
        if isinstance(norm, LogNorm):
            show_plain_ticks(bar.ax.xaxis, (0.5, 1, 2, 5, 10, 20, 50))


def drive_errors(settings: LocalizationConfig, config: SimulationConfig, seed: int) -> dict[str, float]:
    """Errors of a drive in metres: mean distance to the truth, lead along the path, and its scatter."""
    drive = simulated_drive(_MAP, config.model_copy(update={"seed": config.seed + seed}))
    estimated, true = _localize(settings, drive, len(drive.truth)).map_from_base, drive.truth.map_from_base
    ahead = between(true, estimated)[:, 0]
    errors = place_errors(estimated, true)
    return {"errors_m": errors.mean(), "leads_m": ahead.mean(), "scatters_m": ahead.std()}


def milliseconds(settings: LocalizationConfig, config: SimulationConfig) -> float:
    """Median time of an update over the first scans, excluding those that find the start."""
    run = _localize(settings, simulated_drive(_MAP, config), _TIMED_SCANS)
    return float(1e3 * np.median(run.update_seconds[_TIMED_SCANS // 6 :]))


def _localize(settings: LocalizationConfig, drive: SimulatedDrive, scans: int) -> Track:
    start = drive.truth.map_from_base[0]
    rng = np.random.default_rng([settings.beams, settings.particles, 5])
    end = drive.truth.stamps[min(scans, len(drive.truth)) - 1]
    messages = (message for message in drive.messages if message.stamp <= end)
    return track(start_filter(settings, drive.grid, start, _START, rng), messages)


def _short(count: int) -> str:
    return f"{count // 1000}k" if count >= 1000 and count % 1000 == 0 else f"{count}"
