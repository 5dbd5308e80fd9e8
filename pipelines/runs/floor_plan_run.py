"""A floor plan laid under the map of a run, which gets the plan's frame."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.mending.floor_plan import FloorPlan
from racecar.mapping.mending.manual_constraints import Here, Moment
from racecar.mapping.mending.plan_alignment import PlanAlignment, refined_on_walls
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.files.floor_plan_file import load_floor_plan
from racecar.pipelines.files.floor_plan_grid import floor_plan_beside
from racecar.pipelines.runs.run_context import RunContext

_MOMENTS = 3
"""Moments that hold the map in the plan's frame, far apart from each other: they hold it as a whole, and what
the scans measured keeps its shape, because that is known to a centimetre or two, and what a plan draws is
not."""
_TO_SCALE = 0.001
"""Share by which the scale of a plan may be wrong without being mentioned: less than what a map errs by."""


@dataclass(frozen=True)
class PlanRequest:
    """A floor plan, and where it lies under the map."""

    file: Path
    points: Sequence[Sequence[float]]
    """x and y of a point in the coordinates of the file, and x and y of it in the map; two or more."""
    metres_per_unit: float | None = None
    """Scale that the drawing states, such as metres per pixel."""


@dataclass(frozen=True, eq=False)
class LaidPlan:
    """A plan under a map."""

    marks: tuple[Here, ...]
    """Moments at which the map is held in the plan's frame."""
    grid: OccupancyGrid
    """The drawing in its frame in metres."""

    def held(self, edits: MapEdits) -> MapEdits:
        """The edits of the map, which hold it in this frame, and no longer in that of another plan."""
        for entry in edits.constraints:
            if isinstance(entry, Here):
                edits = edits.without(entry)
        for mark in self.marks:
            edits = edits.with_entry(mark)
        return edits


def lay_plan(request: PlanRequest, session: Session, resolution: float, context: RunContext) -> LaidPlan:
    """Lay a plan under the map of a session; the figures go into the report, and the scale is announced.
    ``resolution`` is in metres, for a plan that is no image.

    Raises UserError when the plan cannot be read, or does not fit.
    """
    plan = load_floor_plan(request.file, request.metres_per_unit)
    pairs = np.array(request.points, dtype=np.float64).reshape(-1, 4)
    found = refined_on_walls(plan, session, plan.places(pairs[:, :2]), pairs[:, 2:])
    context.announce(summary := _summary(plan, found))
    figures = {
        "file": request.file,
        "points": pairs,
        "plan_from_map": found.plan_from_map,
        "metres_per_unit": found.metres_per_unit,
        "share_of_walls": found.share,
        "residual_m": found.residual,
        "summary": summary,
    }
    context.report.add("floor_plan", figures)
    return LaidPlan(
        tuple(_marks(session, found.plan_from_map)), plan.drawn(found.metres_per_unit, resolution)
    )


def plan_under(folder: Path, edits: MapEdits) -> OccupancyGrid | None:
    """The plan under the map in a folder; None without one, or when none of its edits holds the map there.
    Raises UserError when it cannot be read."""
    is_held = any(isinstance(each, Here) for each in edits.constraints)
    return floor_plan_beside(folder) if is_held else None


def _marks(session: Session, plan_from_map: Pose) -> Iterator[Here]:
    times, several = session.times, len(session.times.recordings) > 1
    for k in _far_apart(session.map_from_base[:, :2], np.flatnonzero(session.keyframes.is_kept)):
        x, y, yaw = compose(plan_from_map, session.map_from_base[k]).tolist()
        moment = Moment(float(times.seconds[k]), int(times.numbers[k]) if several else None)
        yield Here(moment, (x, y), yaw)


def _far_apart(places: NDArray[np.float64], candidates: NDArray[np.int64]) -> list[int]:
    """Some of the places (K, 2), each as far as can be from those before."""
    apart = np.hypot(*(places[candidates] - places[candidates].mean(axis=0)).T)
    chosen: list[int] = []
    while len(chosen) < _MOMENTS and apart.max() > 0.0:
        chosen.append(int(candidates[np.argmax(apart)]))
        to_newest = np.hypot(*(places[candidates] - places[chosen[-1]]).T)
        apart = to_newest if len(chosen) == 1 else np.minimum(apart, to_newest)
    return chosen or candidates[:1].tolist()


def _summary(plan: FloorPlan, alignment: PlanAlignment) -> str:
    agrees = (
        f"{alignment.share:.0%} of the map's walls lie on those of {plan.name}, "
        f"{100 * alignment.residual:.0f} cm apart"
    )
    if plan.metres_per_unit is None:
        return f"{agrees}; one {plan.unit} is {_length(alignment.metres_per_unit)}."
    factor = plan.metres_per_unit / alignment.metres_per_unit
    if abs(factor - 1.0) < _TO_SCALE:
        return f"{agrees}; it is drawn to scale."
    if 0.5 < factor < 2.0:
        off = f"{abs(100 * (factor - 1.0)):.1f} % too {'large' if factor > 1.0 else 'small'}"
    else:
        off = f"{factor:.3g} times as large as it says"
    return f"{agrees}; it is drawn {off}: one {plan.unit} is {_length(alignment.metres_per_unit)}."


def _length(metres: float) -> str:
    return f"{metres:.3f} m" if metres >= 1.0 else f"{1000 * metres:.3g} mm"
