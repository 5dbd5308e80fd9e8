"""Floor plans as drawings of lines: SVG and DXF."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.mending.floor_plan import FloorPlan, lines_of
from racecar.maps.errors import UserError
from racecar.pipelines.files.optional_packages import require

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from svgelements import SVG, Matrix

_PIECES = 16
"""Straight pieces of a curve, at least. Chosen by judgement: of a column or a door's swing, some
centimetres."""
_ANY_DISTANCE = 1e9
"""Units by which these pieces may deviate, so that only their number counts."""
_NO_WALLS = ("DIMENSION", "HATCH", "LEADER", "MTEXT", "MULTILEADER", "TEXT")
"""Entities of a DXF that only explain the drawing."""


def read_svg(path: Path) -> FloorPlan:
    """Read the visible shapes of an SVG, in units of its viewBox. Raises UserError when that cannot be."""
    require("svgelements", "An SVG as floor plan")
    from svgelements import SVG, Matrix  # slow to import, and rarely needed

    try:
        drawing = SVG.parse(str(path))
        box = drawing.viewbox
        units_from_pixels = ~Matrix(drawing.viewbox_transform)
        top = float(drawing.height if box is None else box.y + box.height)
        lines = lines_of(list(_outlines(drawing, units_from_pixels)))
    except MemoryError:
        raise
    except Exception as error:  # the parser lets any error pass
        raise _unreadable(path, "an SVG", error) from error
    upwards = lines * [1.0, -1.0] + [0.0, top]
    return FloorPlan(path.name, upwards, np.zeros((len(lines), 2)), "unit of the drawing", top=top)


def _outlines(drawing: "SVG", units_from_pixels: "Matrix") -> Iterator[NDArray[np.float64]]:
    """Polylines (N, 2)."""
    from svgelements import Move, Shape
    from svgelements import Path as Outline

    for shape in drawing.elements():
        if isinstance(shape, Shape) and (shape.stroke.value is not None or shape.fill.value is not None):
            for piece in abs(Outline(shape) * units_from_pixels):
                if not isinstance(piece, Move):
                    yield piece.npoint(np.linspace(0.0, 1.0, _PIECES + 1))


def read_dxf(path: Path) -> FloorPlan:
    """Read the lines of a DXF on layers that are not switched off. Raises UserError when that cannot
    be."""
    require("ezdxf", "A DXF as floor plan")
    from ezdxf import recover, units  # slow to import, and rarely needed

    try:
        drawing = recover.readfile(path)[0]
        is_metric = drawing.units != units.InsertUnits.Unitless
        scale = units.conversion_factor(drawing.units, units.InsertUnits.Meters) if is_metric else None
        lines = lines_of(list(_polylines(drawing)))
    except MemoryError:
        raise
    except Exception as error:  # damaged entities raise arbitrary exceptions
        raise _unreadable(path, "a DXF", error) from error
    return FloorPlan(path.name, lines, np.zeros((len(lines), 2)), "unit of the drawing", scale)


def _polylines(drawing: "Drawing") -> Iterator[NDArray[np.float64]]:
    """Polylines (N, 2), those of blocks where they are inserted."""
    from ezdxf import disassemble

    hidden = {layer.dxf.name for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    drawn = [entity for entity in drawing.modelspace() if entity.dxftype() not in _NO_WALLS]
    for entity in disassemble.recursive_decompose(drawn):
        if entity.dxftype() in _NO_WALLS or entity.dxf.layer in hidden:
            continue
        path = disassemble.make_primitive(entity).path
        if path is not None and len(path):
            yield np.array([(point.x, point.y) for point in path.flattening(_ANY_DISTANCE, _PIECES)])


def _unreadable(path: Path, kind: str, error: Exception) -> UserError:
    reason = " ".join(str(error).split()) or type(error).__name__
    return UserError(f"The floor plan {path} cannot be read as {kind} ({reason}): save it again.")
