"""Edits being drawn, with undo for every step."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.grid.edits import Edit, EditKind, covered
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.pipelines.files.edits_file import MapEdits


@dataclass(frozen=True)
class _State:
    edits: MapEdits
    corners: tuple[tuple[float, float], ...] = ()


class Draft:
    """Finished edits, and the corners of the shape being drawn."""

    def __init__(self, grid: TiledGrid, edits: MapEdits) -> None:
        """``grid`` is the map without edits; all coordinates are in its frame."""
        self._grid = grid
        self._states = [_State(edits)]

    @property
    def edits(self) -> MapEdits:
        """The finished edits."""
        return self._states[-1].edits

    @property
    def corners(self) -> NDArray[np.float64]:
        """(N, 2) metres in the map: corners of the unfinished shape."""
        return np.array(self._states[-1].corners, dtype=np.float64).reshape(-1, 2)

    def add_corner(self, place: NDArray[np.float64]) -> None:
        """Add a corner at a place (2,)."""
        state, (x, y) = self._states[-1], place.tolist()
        self._states.append(replace(state, corners=(*state.corners, (x, y))))

    def move_corner(self, number: int, place: NDArray[np.float64]) -> None:
        """Move a corner, by its index from 0, to a place (2,)."""
        state, (x, y) = self._states[-1], place.tolist()
        corners = (*state.corners[:number], (x, y), *state.corners[number + 1 :])
        self._states.append(replace(state, corners=corners))

    def reopen(self, number: int) -> None:
        """Continue a finished edit, by its index from 0. Raises UserError while another shape is drawn."""
        if len(self.corners):
            raise UserError(
                "A shape is not finished: finish it, or undo its corners, and change the other then."
            )
        corners = tuple((float(x), float(y)) for x, y in self.edits.edits[number].points)
        self._states.append(_State(self.edits.without(self.edits.edits[number]), corners))

    def finish(self, kind: EditKind, *, width: float, limit: float) -> None:
        """Make an edit from the corners; a width, in metres, is for walls, a limit, in m/s, for speed zones.

        Raises UserError when they form no such shape, or it covers nothing; the corners are kept then.
        """
        count, fewest = len(self.corners), 2 if kind == "wall" else 3
        if count < fewest:
            raise UserError(f"The shape has {count} of at least {fewest} corners: click on the map for more.")
        drawn = Edit(
            kind,
            self.corners,
            width=width if kind == "wall" else 0.0,
            limit=limit if kind == "speed" else 0.0,
        )
        edits = self.edits.with_entry(drawn)
        if not any(covered(self._grid, edits.edits[-1])):
            raise UserError(
                "What was drawn covers no cell of the map, so that it would change nothing; undo its corners "
                "and click on the map."
            )
        self._states.append(_State(edits))

    def remove(self, number: int) -> None:
        """Remove an edit, by its index from 0."""
        self._states.append(replace(self._states[-1], edits=self.edits.without(self.edits.edits[number])))

    def undo(self) -> None:
        """Undo the last corner, or the last finished or removed shape. Raises UserError at the start."""
        if len(self._states) == 1:
            raise UserError("There is nothing to undo.")
        self._states.pop()
