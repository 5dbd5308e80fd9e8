"""The screen for driving a simulated car."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.mapping.config import MappingConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.tone import Tone
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
from racecar.pipelines.runs.map_outputs import MAP_NAMES
from racecar.pipelines.runs.output_places import OutputFolder, free_folder
from racecar.pipelines.runs.view.headline import Headline, place_headline
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation
from racecar.pipelines.studio.curves import add_curve
from racecar.pipelines.studio.drive.controls import (
    add_hand_controls,
    add_localizer_controls,
    add_world_controls,
)
from racecar.pipelines.studio.drive.discovery import Discovery
from racecar.pipelines.studio.drive.follower import Follower
from racecar.pipelines.studio.drive.tracking import Tracking
from racecar.pipelines.studio.map_image import known_extent
from racecar.pipelines.studio.outlines import car_outline, cross
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.pointed import Pointed
from racecar.pipelines.studio.screen import Screen, Tool
from racecar.pipelines.studio.tools import PoseTool, ToolChoice
from racecar.sensors.scan import Scan

_DISCOVERED = Path("runs", "discovered")
"""Where the map of a discovered floor is saved, if that is free."""
_PERIODS = {"map": 1.0, "plot": 1.0, "words": 0.25}
"""Minimum seconds between drawings. Expensive things, and text, are updated less often."""
_CLICK_RADIUS = 1.0
"""Metres around a click within which the localizer searches for the car: a finger's width on a whole map."""
_GOAL_SIZE = 0.4
"""Size in metres of the cross at the goal."""


class DriveScreen(Screen):
    """A car on a map, with its true pose and either the localizer or a mapper that explores the floor."""

    def __init__(
        self,
        page: Page,
        grid: OccupancyGrid,
        simulation: DrivenSimulation,
        localization: LocalizationConfig,
        mapping: MappingConfig,
    ) -> None:
        """``simulation`` is of a car on the map ``grid``."""
        self._page, self._grid, self._simulation = page, grid, simulation
        self._localization, self._mapping = localization, mapping
        self._goal: NDArray[np.float64] = simulation.truth[:2]
        self._scan: Scan | None = None
        self._seen_at = -np.inf
        """Seconds of the simulation at the last scan with returns."""
        self._is_paused = False
        self._due_at: dict[str, float] = {}
        self._build_panel()
        self._follower: Follower = self._track()
        extent = known_extent(grid)
        assert extent is not None  # the car has found a free place on it
        page.view.show_whole(*extent)

    @property
    def truth(self) -> Pose:
        """(3,) true pose of the car."""
        return self._simulation.truth

    @property
    def is_underway(self) -> bool:
        """Whether the car is driving to a goal."""
        return self._simulation.is_underway

    @property
    def error(self) -> float:
        """Position error in metres of localizer or mapper; nan before the first estimate."""
        return self._follower.errors[-1].metres if self._follower.errors else float("nan")

    @property
    def course_error(self) -> float | None:
        """Position error in metres of the course's filter; None if it is not running."""
        return self._follower.course_error if isinstance(self._follower, Tracking) else None

    @property
    def tool(self) -> Tool:
        """The selected tool."""
        return self._tools.tool

    @property
    def would_be_lost(self) -> str:
        """A map from a discovery that is not saved."""
        if not isinstance(self._follower, Discovery) or not self._follower.keyframes:
            return ""
        return "The discovered map is not saved: save it, or press again to leave without it."

    def rescue(self) -> str:
        """Save the map of a discovery, where that replaces nothing."""
        if not isinstance(self._follower, Discovery) or not self._follower.keyframes:
            return ""
        folder = free_folder(typed_path(self._folder.value), lambda: MAP_NAMES)
        self._follower.save(folder)
        return f"The discovered map is saved in {folder}."

    def step(self, seconds: float) -> None:
        """Drive, and localize or map."""
        if self._is_paused:
            return
        measured = self._simulation.advance(seconds)
        scan = next((each for each in reversed(measured) if isinstance(each, Scan)), None)
        if scan is not None:
            self._scan = scan
            self._seen_at = self._simulation.seconds if scan.is_return.any() else self._seen_at
        self._follower.take(measured, self.truth, self._simulation.seconds)

    def draw(self) -> bool:
        """Draw the car and its estimate."""
        layers, simulation, follower = self._page.layers, self._simulation, self._follower
        layers.line("truth", car_outline(self.truth, layers.car_scale))
        layers.line("planned", simulation.planned)
        if simulation.is_underway:
            layers.segments("goal", cross(self._goal, _GOAL_SIZE))
        else:
            layers.clear("goal")
        layers.dots("walkers", simulation.legs)
        glimpse = follower.glimpse(self._scan)
        if glimpse is not None:
            glimpse.draw(layers)
        if isinstance(follower, Tracking):
            layers.arrows("course", follower.course_particles())
        if self._is_due("map") and (grid := follower.map()) is not None:
            layers.map(grid)
        if self._is_due("words"):
            self._page.frame.head(self._headline())
            state = "On its way." if simulation.is_underway else "The car stands."
            self._state.content = (
                f"{state} {abs(simulation.speed):.1f} m/s, {simulation.seconds:.0f} s\n\n{follower.words()}"
            )
        if self._is_due("plot") and len(follower.errors) > 1:
            errors = np.array(follower.errors)
            self._curve.data = (errors[:, 0], 100.0 * errors[:, 1])
        return True

    def _build_panel(self) -> None:
        page, gui = self._page, self._page.gui
        with page.folder("What a click means"):
            self._tools = ToolChoice(
                page,
                Tool("Drive there", "Click a place, and the car drives there.", self._drive_to),
                PoseTool(
                    page,
                    "2D Pose Estimate",
                    "Drag from where the car is to where it looks: the localizer starts there. A click "
                    "leaves the heading open.",
                    self._say_where,
                ),
                PoseTool(
                    page,
                    "Carry the car",
                    "Drag from where the car shall stand to where it shall look. The localizer is not told.",
                    lambda shown: self._simulation.put_at(shown.pose(otherwise=self.truth[2])),
                ),
            )
            self._state = gui.add_markdown("")
            self._curve = add_curve(gui, "off by (cm), last minute", np.zeros(1), np.zeros(1))
        with page.folder("Localizer") as self._localizer_folder:
            add_localizer_controls(page, self._localization, self._reconfigure)
            page.on_press(gui.add_button("Global localization"), lambda: self._tracking().localizer.scatter())
            page.on_press(gui.add_button("Kidnap the car"), self._simulation.kidnap)
            course = gui.add_checkbox("The course's filter, too", False)
            page.on_change(course, self._run_course)
        with page.folder("World"):
            add_world_controls(page, self._simulation)
            page.on_change(gui.add_checkbox("Pause", False), self._pause)
        with page.folder("By hand", is_open=False):
            add_hand_controls(page, self._simulation.steer, self._simulation.stop)
        with page.folder("Discover the floor", is_open=False):
            gui.add_markdown("The map is hidden, and the mapper draws what the car has seen.")
            self._discover_button = gui.add_button("Discover this floor")
            page.on_press(self._discover_button, self._toggle_discovery)
            self._folder: Any = gui.add_text("Save as", str(free_folder(_DISCOVERED, lambda: MAP_NAMES)))
            page.on_press(gui.add_button("Save the map"), self._save)

    def _drive_to(self, place: NDArray[np.float64]) -> None:
        self._simulation.drive_to(place)
        self._goal = place

    def _say_where(self, shown: Pointed) -> None:
        if shown.heading is None:
            self._tracking().localizer.set_position(shown.place, _CLICK_RADIUS)
        else:
            self._tracking().start_at(np.array([*shown.place, shown.heading]))

    def _pause(self, is_paused: bool) -> None:
        self._is_paused = is_paused

    def _reconfigure(self, values: Mapping[str, Any]) -> None:
        self._localization = self._localization.model_copy(update=values)
        if isinstance(self._follower, Tracking):
            self._follower.localizer.reconfigure(self._localization)

    def _run_course(self, is_wanted: bool) -> None:
        self._tracking().set_course(CourseSettings() if is_wanted else None, self.truth)

    def _tracking(self) -> Tracking:
        """The localizer; switches back to the known map after a discovery."""
        return self._follower if isinstance(self._follower, Tracking) else self._track()

    def _track(self) -> Tracking:
        """Start localizing on the known map."""
        self._follower = tracking = Tracking(self._grid, self._localization, self.truth)
        self._begin_anew()
        self._page.layers.map(self._grid)
        self._discover_button.label = "Discover this floor"
        return tracking

    def _begin_anew(self) -> None:
        """Take away what the follower before has drawn and said."""
        self._page.layers.begin_anew()
        self._curve.data = (np.zeros(1), np.zeros(1))
        self._localizer_folder.visible = isinstance(self._follower, Tracking)
        self._due_at.clear()

    def _headline(self) -> Headline:
        """Whether the localizer knows the place, and how long the car was astray the last time."""
        follower = self._follower
        if not isinstance(follower, Tracking):
            return Headline("The floor is discovered", Tone.NEUTRAL)
        headline = place_headline(follower.estimate, self._simulation.seconds - self._seen_at)
        if follower.found_after is None:
            return headline
        return headline._replace(below=f"Found again after {follower.found_after:.1f} s; {headline.below}")

    def _toggle_discovery(self) -> None:
        if isinstance(self._follower, Discovery):
            self._track()
            return
        self._follower = Discovery(self._mapping, self.truth)
        self._begin_anew()
        self._discover_button.label = "Back to the known map"

    def _save(self) -> None:
        if not isinstance(self._follower, Discovery):
            self._page.tell("There is nothing to save", "Discover the floor first.", "orange")
            return
        folder = typed_path(self._folder.value)
        self._page.check_place(OutputFolder(folder, lambda: MAP_NAMES))
        words = self._follower.save(folder)
        self._folder.value = str(free_folder(folder, lambda: MAP_NAMES))
        self._track()
        self._page.tell(f"Saved in {folder}", words, "green")

    def _is_due(self, what: str) -> bool:
        now = time.monotonic()
        if now < self._due_at.get(what, 0.0):
            return False
        self._due_at[what] = now + _PERIODS[what]
        return True
