"""The controls of the localizer, of the simulated world, and for driving by hand."""

from collections.abc import Callable
from typing import Any

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation
from racecar.pipelines.simulation.simulator_config import NoiseLevel
from racecar.pipelines.studio.page import Page

_NOISES = ("turn_noise_per_turn", "turn_noise_per_metre", "path_noise_per_metre", "path_noise_per_turn")
"""Thrun's alphas, all set by one slider."""
_STEERINGS = {"◀": (0.8, 0.3), "▲": (1.0, 0.0), "▶": (0.8, -0.3), "▼": (-0.8, 0.0)}
"""m/s and radians of each button: walking pace, slow enough to steer by clicks."""
_HELD_PER_SECOND = 5.0
"""Reports per second of a held button."""


def add_localizer_controls(page: Page, config: LocalizationConfig, change: Callable[[Any], None]) -> None:
    """Add sliders; ``change`` receives the changed settings by field name."""
    for fields, label, least, most, step in (
        (("particles",), "Particles", 100, 10_000, 100),
        (("beams",), "Beams", 5, 300, 5),
        (_NOISES, "Motion noise", 0.01, 0.3, 0.01),
    ):
        slider = page.gui.add_slider(label, least, most, step, getattr(config, fields[0]))
        page.on_change(slider, lambda value, fields=fields: change(dict.fromkeys(fields, value)))  # type: ignore[misc]


def add_hand_controls(page: Page, steer: Callable[[float, float], None], stop: Callable[[], None]) -> None:
    """Add buttons that drive while they are held."""
    for label, (speed, steering) in _STEERINGS.items():
        button = page.gui.add_button(label, hint="Hold to drive.")
        _while_held(page, button, lambda speed=speed, steering=steering: steer(speed, steering))  # type: ignore[misc]
    page.on_press(page.gui.add_button("Stop", color="red"), stop)


def add_world_controls(page: Page, simulation: DrivenSimulation) -> None:
    """Add controls that make driving harder; each takes effect at once."""
    gui, conditions = page.gui, simulation.conditions
    noise = gui.add_dropdown(
        "Wheel noise", [level.value for level in NoiseLevel], initial_value=conditions.noise.value
    )
    page.on_change(noise, lambda value: simulation.change(noise=NoiseLevel(value)))
    for field, label, most, step in (
        ("slip", "Wheel slip", 0.5, 0.05),
        ("walkers", "Walkers", 20, 1),
        ("dropped_scans", "Scans dropped", 0.9, 0.1),
        ("max_speed", "Speed (m/s)", 6.0, 0.5),
    ):
        least = step if field == "max_speed" else 0
        slider = gui.add_slider(label, least, most, step, getattr(conditions, field))
        page.on_change(slider, lambda value, field=field: simulation.change(**{field: value}))  # type: ignore[misc]
    blocked = gui.add_checkbox("Laser covered", False)
    page.on_change(blocked, lambda value: simulation.change(is_blocked=value))


def _while_held(page: Page, button: Any, action: Callable[[], None]) -> None:
    async def hold(_: object) -> None:
        page.ask(action)

    button.on_hold(hold, callback_hz=_HELD_PER_SECOND)
