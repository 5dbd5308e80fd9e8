"""The controls of the localizer, and how far it is off."""

from collections.abc import Callable
from typing import Any

import numpy as np
from viser import uplot

from racecar.localization.config import LocalizationConfig
from racecar.pipelines.studio.drive.tracking import Tracking
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import PATH, as_css

_PLOT_HEIGHT = 130
"""Pixels."""
_NOISES = ("turn_noise_per_turn", "turn_noise_per_metre", "path_noise_per_metre", "path_noise_per_turn")
"""Thrun's alphas, which one slider sets together."""


class LocalizerPanel:
    """Sliders that take effect with the next scan, words and a curve."""

    def __init__(
        self, page: Page, config: LocalizationConfig, change: Callable[[LocalizationConfig], None]
    ) -> None:
        """``change`` is asked to take other settings."""
        gui = page.gui
        self._config, self._change = config, change
        self._words = gui.add_markdown("")
        self._plot = gui.add_uplot(
            (np.zeros(1), np.zeros(1)),
            (uplot.Series(label="s"), uplot.Series(label="cm", stroke=as_css(PATH), width=1)),
            title="off by (cm), last minute",
            scales={"x": uplot.Scale(time=False)},
            legend=uplot.Legend(show=False),
            height=_PLOT_HEIGHT,
        )
        for field, label, least, most, step in (
            ("particles", "Particles", 100, 10_000, 100),
            ("beams", "Beams", 5, 300, 5),
        ):
            slider = gui.add_slider(label, least, most, step, getattr(config, field))
            page.on_change(slider, lambda value, field=field: self._set(field, value))  # type: ignore[misc]
        noise = gui.add_slider("Motion noise", 0.01, 0.3, 0.01, config.turn_noise_per_turn)
        page.on_change(noise, lambda value: self._set(_NOISES, value))

    def show(self, tracking: Tracking, particles: int) -> None:
        """How it goes."""
        estimate = tracking.estimate
        if estimate is None or not tracking.errors:
            self._words.content = "Waiting for a scan."
            return
        error = tracking.errors[-1]
        state = "**lost**" if estimate.is_lost else "knows its place"
        self._words.content = (
            f"The localizer {state}: off by **{100 * error.metres:.1f} cm**, "
            f"{np.degrees(error.radians):.1f}°; {particles} particles."
        )
        if tracking.course_error is not None:
            self._words.content += f" The course's filter: off by **{100 * tracking.course_error:.0f} cm**."

    def plot(self, tracking: Tracking) -> None:
        """The curve of the last minute."""
        if len(tracking.errors) > 1:
            errors = np.array(tracking.errors)
            self._plot.data = (errors[:, 0], 100.0 * errors[:, 1])

    def _set(self, fields: str | tuple[str, ...], value: Any) -> None:
        names = (fields,) if isinstance(fields, str) else fields
        self._config = self._config.model_copy(update=dict.fromkeys(names, value))
        self._change(self._config)
