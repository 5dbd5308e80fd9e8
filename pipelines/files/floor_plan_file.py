"""Floor plans as files: images, SVG and DXF."""

from dataclasses import replace
from pathlib import Path

from racecar.mapping.mending.floor_plan import FloorPlan
from racecar.maps.errors import UserError
from racecar.pipelines.files.floor_plan_drawings import read_dxf, read_svg
from racecar.pipelines.files.floor_plan_image import read_plan_image

_MOST_BYTES = 200_000_000
"""Largest plan, since readers take ten times as much memory. Chosen by judgement: a drawing of a campus."""


def load_floor_plan(path: Path, metres_per_unit: float | None = None) -> FloorPlan:
    """Read a plan; a given scale replaces that of the drawing. Raises UserError that says what is wrong."""
    kind = path.suffix.lower()
    if not path.is_file():
        raise UserError(f"There is no floor plan {path}: name an image such as a PNG, an SVG or a DXF.")
    if kind in (".dwg", ".pdf"):
        raise UserError(f"{path} is a {kind[1:].upper()}: save the floor plan as DXF, SVG or PNG.")
    if path.stat().st_size > _MOST_BYTES:
        raise UserError(f"{path} is larger than {_MOST_BYTES // 1_000_000} MB: save the walls of one floor.")
    plan = {".svg": read_svg, ".dxf": read_dxf}.get(kind, read_plan_image)(path)
    if len(plan.lines) == 0:
        raise UserError(f"The floor plan {path} shows no lines that could be walls: save one that does.")
    return plan if metres_per_unit is None else replace(plan, metres_per_unit=metres_per_unit)
