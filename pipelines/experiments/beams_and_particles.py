"""What beams and particles buy, and what they cost."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.warm_up import warm_up
from racecar.maps.geometry.se2 import between
from racecar.pipelines.experiments.figure_style import (
    MAP_OF_NUMBERS,
    Picture,
    drawing,
    finish,
    show_plain_ticks,
)
from racecar.pipelines.experiments.filters import start_filter
from racecar.pipelines.experiments.result import ExperimentSettings, FigureTable
from racecar.pipelines.experiments.shared_drives import simulated_drive
from racecar.pipelines.experiments.tracking import Track, place_errors, track
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig

_BEAMS = (25, 50, 100, 200, 400)
_PARTICLES = (200, 500, 1000, 2000, 5000, 10_000, 20_000)
_MAP = "track"
_START = (0.1, 0.1, 0.05)
_TIMED_SCANS = 60


@dataclass(frozen=True, eq=False)
class BeamsAndParticles:
    """Error and time for each pair."""

    beams: tuple[int, ...]
    particles: tuple[int, ...]
    errors: NDArray[np.float64]
    """(beams, particles, seeds) metres, mean over the drive."""
    leads: NDArray[np.float64]
    """(beams, particles, seeds) metres by which the estimate is ahead of the car, mean over the drive."""
    scatters: NDArray[np.float64]
    """(beams, particles, seeds) metres of standard deviation about that, along the path."""
    milliseconds: NDArray[np.float64]
    """(beams, particles) per update, the median."""
    chosen: tuple[int, int]
    """Beams and particles of the configuration in use."""
    title: str = "Beams and particles: accuracy against time"

    def text(self) -> list[str]:
        errors = 100 * self.errors.mean(axis=2)
        best = np.unravel_index(np.argmin(errors), errors.shape)
        return [
            f"Drives of the shipped track with full odometry noise, {self.errors.shape[2]} seeds, the "
            "number of particles held fixed. The error is the mean distance to the truth over the drive; "
            "the time is the median of an update, measured one after the other with nothing beside it, so "
            "it depends on the machine and is not the same twice.",
            f"The smallest error, {errors[best]:.1f} cm, has {self.beams[best[0]]} beams and "
            f"{self.particles[best[1]]} particles at {self.milliseconds[best]:.1f} ms; the largest is "
            f"{errors.max():.1f} cm. The configuration in use has {self.chosen[0]} beams and at most "
            f"{self.chosen[1]} particles.",
            self._what_more_beams_do(),
        ]

    def _what_more_beams_do(self) -> str:
        """Why the error need not fall with more beams."""
        (few_lead, *_, many_lead), (few_scatter, *_, many_scatter) = (
            100 * values.mean(axis=(1, 2)) for values in (self.leads, self.scatters)
        )
        return (
            f"From {self.beams[0]} to {self.beams[-1]} beams the scatter along the path goes from "
            f"{few_scatter:.1f} to {many_scatter:.1f} cm, and the lead, by which the estimate is ahead of "
            f"the car on average, from {few_lead:.1f} to {many_lead:.1f} cm. More beams average out chance, "
            "but not what all of them have in common, and the more of them count, the less the odometry "
            "holds against it. The lead does not grow with the speed, so it is no delay, and there is none "
            "to the side, where walls stand left and right: the laser sees walls ahead but not behind, so "
            "that what the expected ranges are off by does not cancel along the path."
        )

    def tables(self) -> list[FigureTable]:
        columns = ("beams", *(f"{count} particles" for count in self.particles))
        errors, deviations = 100 * self.errors.mean(axis=2), 100 * self.errors.std(axis=2)
        leads, scatters = 100 * self.leads.mean(axis=2), 100 * self.scatters.mean(axis=2)
        return [
            FigureTable(
                "Mean distance to the truth (cm), mean ± standard deviation over the seeds",
                columns,
                [
                    (f"{count}", *(f"{mean:.2f} ± {std:.2f}" for mean, std in zip(*row, strict=True)))
                    for count, *row in zip(self.beams, errors, deviations, strict=True)
                ],
            ),
            FigureTable(
                "Lead along the path (cm), mean ± scatter along the path",
                columns,
                [
                    (f"{count}", *(f"{lead:.2f} ± {scatter:.2f}" for lead, scatter in zip(*row, strict=True)))
                    for count, *row in zip(self.beams, leads, scatters, strict=True)
                ],
            ),
            FigureTable(
                "Time of an update (ms)",
                columns,
                [
                    (f"{count}", *(f"{value:.2f}" for value in row))
                    for count, row in zip(self.beams, self.milliseconds, strict=True)
                ],
            ),
        ]

    def figures(self) -> dict[str, Any]:
        return {
            "beams": self.beams,
            "particles": self.particles,
            "errors_m": self.errors,
            "leads_m": self.leads,
            "scatters_m": self.scatters,
            "measured_times": {"milliseconds_per_update": self.milliseconds},
        }

    def pictures(self) -> list[Picture]:
        return [
            self._heat_map(
                "beams-and-particles-error",
                "Mean distance to the truth in centimetres, for each number of beams and particles.",
                100 * self.errors.mean(axis=2),
                "mean error (cm)",
                Normalize(),
            ),
            self._heat_map(
                "beams-and-particles-time",
                "Time of an update in milliseconds, for each number of beams and particles.",
                self.milliseconds,
                "time of an update (ms)",
                LogNorm(),
            ),
        ]

    def _heat_map(
        self, name: str, shows: str, values: NDArray[np.float64], label: str, norm: Normalize
    ) -> Picture:
        with drawing(62) as figure:
            axes = figure.subplots()
            image = axes.imshow(values, cmap=MAP_OF_NUMBERS, norm=norm, origin="lower", aspect="auto")
            self._write_values(axes, values, norm)
            axes.set_xticks(range(len(self.particles)), [_short(count) for count in self.particles])
            axes.set_yticks(range(len(self.beams)), [f"{count}" for count in self.beams])
            axes.set(xlabel="particles", ylabel="beams")
            axes.grid(visible=False)
            bar = figure.colorbar(image, ax=axes, location="top", shrink=0.9)
            bar.set_label(label)
            if isinstance(norm, LogNorm):
                show_plain_ticks(bar.ax.xaxis, (0.5, 1, 2, 5, 10, 20, 50))
            return finish(figure, name, shows)

    def _write_values(self, axes: Axes, values: NDArray[np.float64], norm: Normalize) -> None:
        for (row, column), value in np.ndenumerate(values):
            color = "black" if norm(value) > 0.5 else "white"
            axes.text(column, row, f"{value:.1f}", ha="center", va="center", color=color, fontsize=6)


def beams_and_particles(settings: ExperimentSettings, parallel: ParallelRuns) -> BeamsAndParticles:
    """All pairs; 3 seeds for the accuracy. When quick, fewer of both, one seed and a shorter drive."""
    beams = _BEAMS[::2] if settings.quick else _BEAMS
    particles = _PARTICLES[::3] if settings.quick else _PARTICLES
    seeds = range(1 if settings.quick else 3)
    seconds = 6.0 if settings.quick else 20.0
    pairs = [(beam_count, particle_count) for beam_count in beams for particle_count in particles]
    configs = [_with_counts(settings.localization, *pair) for pair in pairs]
    drives = [
        SimulationConfig(noise=NoiseLevel.FULL, seed=1000 * settings.seed + seed, duration=seconds)
        for seed in seeds
    ]
    errors = parallel.run(
        "Beams and particles", drive_errors, [(config, drive) for config in configs for drive in drives]
    )
    warm_up(LocalizationConfig())
    times = parallel.here("Timing", milliseconds, [(config, drives[0]) for config in configs])
    shape = (len(beams), len(particles))
    means, leads, scatters = np.moveaxis(np.array(errors).reshape(*shape, len(seeds), 3), -1, 0)
    return BeamsAndParticles(
        beams,
        particles,
        means,
        leads,
        scatters,
        np.array(times).reshape(shape),
        (settings.localization.beams, settings.localization.particles),
    )


def drive_errors(settings: LocalizationConfig, config: SimulationConfig) -> tuple[float, float, float]:
    """Metres over a drive: mean distance to the truth, lead along the path, and scatter about that."""
    drive = simulated_drive(_MAP, config)
    estimated, true = _localize(settings, drive, len(drive.truth)).map_from_base, drive.truth.map_from_base
    off = between(true, estimated)[:, 0]
    return float(place_errors(estimated, true).mean()), float(off.mean()), float(off.std())


def milliseconds(settings: LocalizationConfig, config: SimulationConfig) -> float:
    """Of an update, the median over the first scans but those that find the start."""
    run = _localize(settings, simulated_drive(_MAP, config), _TIMED_SCANS)
    return float(1e3 * np.median(run.update_seconds[_TIMED_SCANS // 6 :]))


def _localize(settings: LocalizationConfig, drive: SimulatedDrive, scans: int) -> Track:
    start = drive.truth.map_from_base[0]
    rng = np.random.default_rng([settings.beams, settings.particles, 5])
    end = drive.truth.stamps[min(scans, len(drive.truth)) - 1]
    messages = (message for message in drive.messages if message.stamp <= end)
    return track(start_filter(settings, drive.grid, start, _START, rng), messages)


def _with_counts(settings: LocalizationConfig, beams: int, particles: int) -> LocalizationConfig:
    """So many beams, and so many particles, no more and no fewer."""
    return settings.model_copy(
        update={
            "beams": beams,
            "particles": particles,
            "fewest_particles": particles,
            "scattered_particles": particles,
        }
    )


def _short(count: int) -> str:
    return f"{count // 1000}k" if count >= 1000 and count % 1000 == 0 else f"{count}"
