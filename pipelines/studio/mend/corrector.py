"""The map of a session under manual constraints: its keyframes, its picture, and the verdict on it."""

from collections.abc import Sequence
from dataclasses import dataclass

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.rendering import pixels_of
from racecar.mapping.mending.deformation import Deformation
from racecar.mapping.mending.effect import Effect
from racecar.mapping.mending.manual_constraints import ManualConstraint
from racecar.mapping.mending.mender import Mender
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.session.drawing import Views, draw_map
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.edits import edited
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.thinning import thinned
from racecar.maps.map_files import as_written
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.studio.map_image import MOST_CELLS

Outcome = Effect | RefusedConstraintError
"""What a constraint did, or why it was refused."""


@dataclass(frozen=True, eq=False)
class CorrectedMap:
    """A map, and what manual constraints did to it."""

    outcomes: tuple[Outcome, ...]
    """One for each constraint."""
    map_from_keyframe: Pose
    """(K, 3)"""
    grid: OccupancyGrid
    quality: MapQuality

    @property
    def refused(self) -> list[RefusedConstraintError]:
        """Why some constraints are without effect."""
        return [outcome for outcome in self.outcomes if isinstance(outcome, RefusedConstraintError)]

    def words(self, number: int) -> str:
        """The outcome of a constraint, by its index, in a sentence."""
        outcome = self.outcomes[number]
        return outcome.summary if isinstance(outcome, Effect) else str(outcome)


class Corrector:
    """Keeps what is solved already, so that each further constraint costs a few seconds."""

    def __init__(self, session: Session, config: MappingConfig) -> None:
        self._session, self._config = session, config
        self._mender = Mender(session)
        self._solved: list[tuple[ManualConstraint, Outcome]] = []

    def map_with(self, edits: MapEdits) -> CorrectedMap:
        """The map under edits, which are in the frame of the session's map."""
        constraints = edits.constraints
        alike = _begin_in_common([each for each, _ in self._solved], constraints)
        while len(self._solved) > alike:
            _, outcome = self._solved.pop()
            if isinstance(outcome, Effect):
                self._mender.undo()
        for constraint in constraints[alike:]:
            self._solved.append((constraint, self._outcome_of(constraint)))
        session = self._mender.session()
        return CorrectedMap(
            tuple(outcome for _, outcome in self._solved),
            session.map_from_keyframe,
            self._picture_of(session, edits),
            judge(FinishedMap(session), self._config.quality),
        )

    def _outcome_of(self, constraint: ManualConstraint) -> Outcome:
        try:
            return self._mender.add(constraint)
        except RefusedConstraintError as error:
            return error

    def _picture_of(self, session: Session, edits: MapEdits) -> OccupancyGrid:
        rendering = self._config.rendering
        drawn = draw_map(Views.of(session), session.keyframes, self._config.resolution, rendering)
        carried = edits.carried(Deformation(self._session, session).places)
        return thinned(as_written(edited(drawn.tiled, carried.edits), **pixels_of(rendering)), MOST_CELLS)


def _begin_in_common(first: Sequence[ManualConstraint], second: Sequence[ManualConstraint]) -> int:
    """How many are the same from the beginning on."""
    are_alike = [a == b for a, b in zip(first, second, strict=False)]
    return are_alike.index(False) if False in are_alike else len(are_alike)
