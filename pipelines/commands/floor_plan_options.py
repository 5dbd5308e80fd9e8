"""Flags for a floor plan under a map."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import numbers_in

if TYPE_CHECKING:
    from racecar.pipelines.runs.floor_plan_run import PlanRequest

_FARTHEST = 1e8
"""Pixels, units or metres; no plan or building is larger, since the earth's circumference is 4e7 m."""


@dataclass(frozen=True, kw_only=True)
class PlanFlags:
    """A floor plan, and where it lies."""

    plan: Annotated[
        Path | None,
        typer.Option(
            "--plan",
            metavar="FILE",
            help="A floor plan (PNG, SVG, DXF) to lay under the map, which gets its frame.",
        ),
    ] = None
    plan_point: Annotated[
        list[str] | None,
        typer.Option(
            "--plan-point",
            metavar="'PX PY X Y'",
            help="A point of the plan, in pixels from its upper left or units of the drawing, and its place "
            "in the map of DIR in metres; two or more. The walls refine them.",
        ),
    ] = None
    plan_scale: Annotated[
        float | None,
        typer.Option("--plan-scale", metavar="M", help="Metres per pixel, or per unit, as the plan says."),
    ] = None

    @property
    def requested(self) -> "PlanRequest | None":
        """The plan, if there is one. Raises UserError when the flags do not go together."""
        from racecar.maps.errors import UserError
        from racecar.pipelines.runs.floor_plan_run import PlanRequest

        texts = self.plan_point or []
        if self.plan is None:
            if texts or self.plan_scale is not None:
                raise UserError("--plan-point and --plan-scale are of a floor plan: name it by --plan.")
            return None
        points = [tuple(numbers_in(text) or ()) for text in texts]
        wrong = [repr(text) for text, known in zip(texts, points, strict=True) if not _is_point(known)]
        if wrong or len(points) < 2:
            raise UserError(
                "--plan needs two points or more, each as --plan-point 'PX PY X Y', its place in plan and "
                f"map: {f'{wrong[0]} is none' if wrong else f'there are {len(points)}'}."
            )
        if self.plan_scale is not None and not 0.0 < self.plan_scale < _FARTHEST:
            raise UserError(f"--plan-scale {self.plan_scale:g} is no scale: give metres per pixel, or unit.")
        return PlanRequest(self.plan, points, self.plan_scale)


def _is_point(numbers: tuple[float, ...]) -> bool:
    return len(numbers) == 4 and all(abs(number) < _FARTHEST for number in numbers)
