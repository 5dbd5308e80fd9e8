"""Edits while they are drawn, with a way back from every step."""

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
    """Finished edits, and the corners of the shape that is being drawn."""

    def __init__(self, grid: TiledGrid, edits: MapEdits) -> None:
        """``grid`` is the map without edits, in whose frame all places are."""
        self._grid = grid
        self._states = [_State(edits)]

    @property
    def edits(self) -> MapEdits:
        """Those that are finished."""
        return self._states[-1].edits

    @property
    def corners(self) -> NDArray[np.float64]:
        """(N, 2) metres in the map: of the shape that is not finished yet."""
        return np.array(self._states[-1].corners, dtype=np.float64).reshape(-1, 2)

    def add_corner(self, place: NDArray[np.float64]) -> None:
        """Go on to a place (2,)."""
        state, (x, y) = self._states[-1], place.tolist()
        self._states.append(replace(state, corners=(*state.corners, (x, y))))

    def move_corner(self, number: int, place: NDArray[np.float64]) -> None:
        """Let a corner, by its number from 0, lie at a place (2,)."""
        state, (x, y) = self._states[-1], place.tolist()
        corners = (*state.corners[:number], (x, y), *state.corners[number + 1 :])
        self._states.append(replace(state, corners=corners))

    def reopen(self, number: int) -> None:
        """Draw on at a finished edit, by its number from 0. Raises UserError while another shape is drawn."""
        if len(self.corners):
            raise UserError(
                "A shape is not finished: finish it, or undo its corners, and change the other then."
            )
        corners = tuple((float(x), float(y)) for x, y in self.edits.edits[number].points)
        self._states.append(_State(self.edits.without(number), corners))

    def finish(self, kind: EditKind, *, width: float, limit: float) -> None:
        """Make an edit of the corners; a width, metres, is of walls, a limit, metres per second, of speed.

        Raises UserError when they are no such shape, or it covers nothing; the corners stay then.
        """
        drawn = Edit(
            kind,
            self.corners,
            width=width if kind == "wall" else 0.0,
            limit=limit if kind == "speed" else 0.0,
        )
        edits = self.edits.with_edit(drawn)
        if not any(covered(self._grid, edits.edits[-1])):
            raise UserError(
                "What was drawn covers no cell of the map, so that it would change nothing; undo its corners "
                "and click on the map."
            )
        self._states.append(_State(edits))

    def remove(self, number: int) -> None:
        """Take an edit away, by its number from 0."""
        self._states.append(replace(self._states[-1], edits=self.edits.without(number)))

    def undo(self) -> None:
        """Go back by a corner, or by a shape that was finished or removed. Raises UserError at the start."""
        if len(self._states) == 1:
            raise UserError("There is nothing to undo.")
        self._states.pop()
