"""All experiments by name."""

from collections.abc import Mapping
from functools import partial

from racecar.pipelines.experiments.autograde import autograde
from racecar.pipelines.experiments.beams_and_particles import beams_and_particles
from racecar.pipelines.experiments.convergence import convergence
from racecar.pipelines.experiments.motion_model import motion_model
from racecar.pipelines.experiments.noise_sweep import noise_sweep
from racecar.pipelines.experiments.real_run import real_run
from racecar.pipelines.experiments.recording import BagRecording, StandIn
from racecar.pipelines.experiments.result import Experiment, Settings
from racecar.pipelines.experiments.sensor_model import sensor_model

_STAND_IN_SECONDS, _QUICK_SECONDS = 40.0, 15.0


def catalogue(settings: Settings, recording: BagRecording | None = None) -> Mapping[str, Experiment]:
    """The experiments in the order of a report; where no recording is given, a simulated drive stands in."""
    stand_in = StandIn(settings.seed, _QUICK_SECONDS if settings.quick else _STAND_IN_SECONDS)
    return {
        "sensor-model": sensor_model,
        "motion-model": motion_model,
        "noise-sweep": noise_sweep,
        "convergence": partial(convergence, recording=recording),
        "autograde": autograde,
        "beams-and-particles": beams_and_particles,
        "real-run": partial(real_run, recording=recording or stand_in),
    }
