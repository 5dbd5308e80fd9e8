"""The room in which a simulated car is driven."""

import time
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.mapping.config import MappingConfig
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.typed_path import typed_path
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
from racecar.pipelines.simulation.driven_simulation import DrivenSimulation
from racecar.pipelines.studio.drive.discovery import Discovery
from racecar.pipelines.studio.drive.localizer_panel import LocalizerPanel
from racecar.pipelines.studio.drive.tracking import Tracking
from racecar.pipelines.studio.drive.world_panel import add_hand_controls, add_world_controls
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.map_image import known_extent, paint
from racecar.pipelines.studio.outlines import car_outline, cross, ellipse
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import CAR, LOOP, PARTICLE, PATH, SCAN, SKY, TRUTH
from racecar.pipelines.studio.pointed import Pointed
from racecar.pipelines.studio.pointer import Pointer
from racecar.pipelines.studio.room import Room
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_PERIODS = {"map": 1.0, "plot": 1.0, "words": 0.25}
"""Seconds from one drawing to the next: what costs more, or is read and not seen, is drawn less often."""
_CLICK_RADIUS = 1.0
"""Metres about a click within which the localizer is to look for the car: a finger's width on a whole map."""
_PARTICLE_LENGTH, _GOAL_SIZE, _SIGMAS = 0.15, 0.4, 3.0
"""Metres of a particle's arrow and of the goal's cross; standard deviations that the ellipse shows."""


class Tool(str, Enum):
    """What clicks and drags on the floor mean, as the panel names it."""

    DRIVE = "Drive there"
    ESTIMATE = "Say where the car is"
    CARRY = "Carry the car"


_TOOLS = {
    Tool.DRIVE: "Click a place, and the car drives there.",
    Tool.ESTIMATE: "Drag from where the car is to where it looks: the localizer starts there. "
    "A click leaves the heading open.",
    Tool.CARRY: "Drag from where the car shall stand to where it shall look. The localizer is not told.",
}


class DriveRoom(Room):
    """A car on a map, with the localizer beside the truth or a mapper that discovers the floor."""

    def __init__(
        self,
        page: Page,
        grid: OccupancyGrid,
        simulation: DrivenSimulation,
        localization: LocalizationConfig,
        mapping: MappingConfig,
    ) -> None:
        """``simulation`` is of a car on the map ``grid``."""
        self._page, self._grid, self._mapping, self._simulation = page, grid, mapping, simulation
        self._tracking: Tracking | None = Tracking(grid, localization, self._simulation.truth)
        self._localization = localization
        self._discovery: Discovery | None = None
        self._goal: NDArray[np.float64] = self._simulation.truth[:2]
        self._scan: Scan | None = None
        self._is_paused = False
        self._due_at: dict[str, float] = {}
        self._build_panel()
        extent = known_extent(grid)
        assert extent is not None  # the car has found room in it
        page.view.show_whole(*extent)

    @property
    def truth(self) -> Pose:
        """(3,) where the car is."""
        return self._simulation.truth

    @property
    def is_underway(self) -> bool:
        """Whether the car is on its way to a goal."""
        return self._simulation.is_underway

    @property
    def localizer_error(self) -> float:
        """Metres by which the localizer is off; nan before it says anything."""
        errors = None if self._tracking is None else self._tracking.errors
        return errors[-1].metres if errors else float("nan")

    @property
    def course_error(self) -> float | None:
        """Metres by which the course's filter is off; None where it does not run."""
        return None if self._tracking is None else self._tracking.course_error

    @property
    def would_be_lost(self) -> str:
        """A map that was discovered."""
        if self._discovery is None or not self._discovery.keyframes:
            return ""
        return "The discovered map is not saved: save it, or press again to leave without it."

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Only goals are clicked and never dragged."""
        return self._pointer.tool != Tool.DRIVE

    def draw_all(self) -> None:
        """Draw the map, or what has been discovered of it."""
        self._page.layers.clear_all()
        if self._discovery is None:
            self._page.layers.image("map", paint(self._grid, self._page.ground))
        else:
            self._draw_discovered(self._discovery)
        self._draw_legend()

    def step(self, seconds: float) -> None:
        """Drive, and localize or map."""
        if not self._is_paused:
            self._follow(self._simulation.advance(seconds))

    def draw(self) -> None:
        """Draw the car and what is believed of it."""
        self._draw_car()
        if self._is_due("map") and self._discovery is not None:
            self._draw_discovered(self._discovery)
        if self._is_due("words"):
            self._tell()
        if self._is_due("plot") and self._tracking is not None:
            self._panel.plot(self._tracking)

    def click(self, place: NDArray[np.float64]) -> None:
        """What the tool means."""
        self._take(self._pointer.click(place))

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """A pose: the place and where it looks."""
        shown = self._pointer.drag(start, end, is_over=is_over)
        if shown is not None:
            self._take(shown)

    def _build_panel(self) -> None:
        page = self._page
        gui = page.gui
        with page.folder("What a click means"):
            self._pointer = Pointer(page, _TOOLS)
            self._state = gui.add_markdown("")
        with page.folder("Localizer"):
            self._panel = LocalizerPanel(page, self._localization, self._reconfigure)
            page.on_press(gui.add_button("Search the whole map"), lambda: self._tracked().scatter())
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
            self._folder = gui.add_text("Save as", "runs/discovered")
            page.on_press(gui.add_button("Save the map"), self._save)

    def _take(self, shown: Pointed) -> None:
        tool = self._pointer.tool
        if tool == Tool.DRIVE:
            self._simulation.drive_to(shown.place)
            self._goal = shown.place
        elif tool == Tool.CARRY:
            self._simulation.put_at(shown.pose(otherwise=self._simulation.truth[2]))
        elif shown.heading is None:
            self._tracked().start_near(shown.place, _CLICK_RADIUS)
        else:
            self._tracked().start_at(np.array([*shown.place, shown.heading]))

    def _pause(self, is_paused: bool) -> None:
        self._is_paused = is_paused

    def _tracked(self) -> Tracking:
        """The localizer; back on the known map when the floor was being discovered."""
        if self._tracking is None:
            self._stop_discovery()
        assert self._tracking is not None
        return self._tracking

    def _reconfigure(self, config: LocalizationConfig) -> None:
        self._localization = config
        if self._tracking is not None:
            self._tracking.reconfigure(config)

    def _run_course(self, is_wanted: bool) -> None:
        self._tracked().set_course(CourseSettings() if is_wanted else None, self._simulation.truth)
        self._draw_legend()

    def _toggle_discovery(self) -> None:
        if self._discovery is not None:
            self._stop_discovery()
            return
        self._discovery = Discovery(self._mapping, self._simulation.truth)
        self._tracking = None
        self._discover_button.label = "Back to the known map"
        self.draw_all()

    def _stop_discovery(self) -> None:
        self._discovery = None
        self._tracking = Tracking(self._grid, self._localization, self._simulation.truth)
        self._discover_button.label = "Discover this floor"
        self.draw_all()

    def _save(self) -> None:
        if self._discovery is None:
            self._page.tell("There is nothing to save", "Discover the floor first.", "orange")
            return
        folder = typed_path(self._folder.value)
        words = self._discovery.save(folder)
        self._stop_discovery()
        self._page.tell(f"Saved in {folder}", words, "green")

    def _follow(self, measured: list[Measurement]) -> None:
        for measurement in measured:
            if isinstance(measurement, Scan):
                self._scan = measurement
        if self._tracking is not None:
            self._tracking.take(measured, self._simulation.truth, self._simulation.seconds)
        if self._discovery is not None:
            self._discovery.take(measured)

    def _draw_car(self) -> None:
        layers, simulation = self._page.layers, self._simulation
        truth = simulation.truth
        layers.line("truth", car_outline(truth), TRUTH, 4.0)
        layers.line("planned", simulation.planned, SKY, 2.0)
        goal = cross(self._goal, _GOAL_SIZE) if simulation.is_underway else np.zeros((0, 2, 2))
        layers.segments("goal", goal, LOOP, 4.0)
        layers.dots("mark", simulation.legs, LOOP, 7.0)
        believed = self._draw_tracked() if self._tracking is not None else self._draw_mapped()
        if believed is not None and self._scan is not None:
            points = transform_points(believed, self._scan.points_in_base())
            layers.dots("scan", points, SCAN, 3.0)

    def _draw_tracked(self) -> Pose | None:
        """Particles and estimate; the pose (3,) that is believed."""
        layers, tracking = self._page.layers, self._tracking
        assert tracking is not None
        particles, self._particle_count = tracking.particles()
        layers.arrows("particles", particles, PARTICLE, _PARTICLE_LENGTH, 1.5)
        layers.arrows("course", tracking.course_particles(), SKY, _PARTICLE_LENGTH, 1.5)
        estimate = tracking.estimate
        if estimate is None:
            return None
        pose = estimate.map_from_base
        layers.line("car", car_outline(pose), CAR, 4.0)
        layers.line("ellipse", ellipse(pose[:2], estimate.covariance[:2, :2], _SIGMAS), CAR, 2.0)
        return pose

    def _draw_mapped(self) -> Pose | None:
        """The car as the mapper knows it; its pose (3,)."""
        pose = None if self._discovery is None else self._discovery.pose
        if pose is not None:
            self._page.layers.line("car", car_outline(pose), CAR, 4.0)
        return pose

    def _draw_discovered(self, discovery: Discovery) -> None:
        grid = discovery.draw()
        if grid is not None:
            self._page.layers.image("map", paint(grid, self._page.ground))
            self._page.layers.line("path", discovery.keyframe_places()[:, :2], PATH, 3.0)

    def _draw_legend(self) -> None:
        entries = [Entry("car, as it is", [TRUTH]), Entry("car, as estimated", [CAR]), Entry("scan", [SCAN])]
        if self._tracking is not None:
            entries.append(Entry("particle, with its heading", [PARTICLE]))
            if len(self._tracking.course_particles()):
                entries.append(Entry("the course's filter", [SKY]))
        else:
            entries.append(Entry("path, as mapped", [PATH]))
        entries.append(Entry("goal, walkers", [LOOP]))
        self._page.legend.show(entries)

    def _tell(self) -> None:
        simulation = self._simulation
        state = "On its way." if simulation.is_underway else "The car stands."
        words = f"{state} {abs(simulation.speed):.1f} m/s, {simulation.seconds:.0f} s"
        if self._discovery is not None and self._discovery.pose is not None:
            off = self._discovery.pose - simulation.truth
            words += (
                f"; {self._discovery.keyframes} keyframes, off by {100 * float(np.hypot(*off[:2])):.1f} cm"
            )
        self._state.content = words
        if self._tracking is not None:
            self._panel.show(self._tracking, self._particle_count)

    def _is_due(self, what: str) -> bool:
        now = time.monotonic()
        if now < self._due_at.get(what, 0.0):
            return False
        self._due_at[what] = now + _PERIODS[what]
        return True
