"""A correction in progress: a change is shown before it is kept, and every step can be undone."""

from collections.abc import Callable
from dataclasses import dataclass

from racecar.mapping.mending.manual_constraints import ManualConstraint
from racecar.maps.errors import UserError
from racecar.pipelines.files.edits_file import MapEdits
from racecar.pipelines.studio.mend.corrector import CorrectedMap


@dataclass(frozen=True, eq=False)
class Step:
    """Edits, and the map under their constraints."""

    edits: MapEdits
    map: CorrectedMap


class Correction:
    """Constraints that are kept, and a change of them that is previewed."""

    def __init__(self, edits: MapEdits, ask: Callable[[MapEdits], None]) -> None:
        """``ask`` requests the map under edits, which `take` receives later; first that under ``edits``."""
        self._kept: list[Step] = []
        self._ask, self._asked = ask, edits
        self.preview: Step | None = None
        """What is shown and neither kept nor discarded yet."""
        ask(edits)

    @property
    def kept(self) -> Step | None:
        """The last step that was kept; None until the first map is there."""
        return self._kept[-1] if self._kept else None

    @property
    def shown(self) -> Step | None:
        """The preview if there is one, otherwise what is kept."""
        return self.preview or self.kept

    @property
    def decided(self) -> Step:
        """What is kept. Raises UserError while another change is previewed, or before the first map."""
        if self.preview is not None:
            raise UserError("Keep or discard first what is tried: the map shows it already.")
        if self.kept is None:
            raise UserError("The map is not judged yet; one moment.")
        return self.kept

    @property
    def adds(self) -> bool:
        """Whether the preview adds a constraint; otherwise it removes one."""
        if self.kept is None or self.preview is None:
            return False
        return len(self.preview.edits.constraints) > len(self.kept.edits.constraints)

    def add(self, constraint: ManualConstraint) -> None:
        """Try one more constraint. Raises UserError while another change is not decided on."""
        self._try(self.decided.edits.with_entry(constraint))

    def remove(self, number: int) -> None:
        """Try to do without a constraint, by its index. Raises UserError as `add`."""
        edits = self.decided.edits
        self._try(edits.without(edits.constraints[number]))

    def take(self, map: CorrectedMap) -> None:
        """Receive the map that was asked for. Raises RefusedConstraintError, and tries nothing, when a
        constraint is refused that was not before."""
        step = Step(self._asked, map)
        if (kept := self.kept) is None:
            self._kept.append(step)
            return
        known = {str(refused) for refused in kept.map.refused}
        for refused in map.refused:
            if str(refused) not in known:
                raise refused
        self.preview = step

    def keep(self) -> None:
        """Keep the preview. Raises UserError when there is none."""
        self._kept.append(self._tried())
        self.preview = None

    def discard(self) -> None:
        """Go back to what is kept. Raises UserError when there is no preview."""
        self._tried()
        self.preview = None

    def undo(self) -> None:
        """Take back the preview, otherwise the last change that was kept. Raises UserError at the start."""
        if self.preview is not None:
            self.preview = None
        elif len(self._kept) > 1:
            self._kept.pop()
        else:
            raise UserError("There is nothing to undo.")

    def _try(self, edits: MapEdits) -> None:
        self._asked = edits
        self._ask(edits)

    def _tried(self) -> Step:
        if self.preview is None:
            raise UserError("Nothing is tried: choose a doubt, and say what it is.")
        return self.preview
