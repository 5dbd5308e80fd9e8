"""The session in a folder, with the manual constraints among its edits."""

from dataclasses import dataclass
from pathlib import Path

from racecar.mapping.mending.deformation import Deformation
from racecar.mapping.mending.mender import Mender
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.grid.edits import Edit
from racecar.pipelines.files.edits_file import MapEdits, edits_beside
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.runs.run_context import RunContext


@dataclass(frozen=True, eq=False)
class CorrectedSession:
    """A session, and edits on its map."""

    folder: Path
    session: Session
    edits: MapEdits
    deformation: Deformation | None = None
    """How the map was bent; None if it lies as it did when it was written."""


def load_corrected(folder: Path, context: RunContext, edits: MapEdits | None = None) -> CorrectedSession:
    """Load a session, and correct it by the manual constraints among the ``edits``, by default those beside
    it, unless it was written with the same ones. What each does is announced, and added to the report.

    Raises UserError when something cannot be read, and when a constraint is refused.
    """
    edits = edits_beside(folder) if edits is None else edits
    session = load_session(folder)
    known = "" if session.measured is None else session.measured.mended_by
    if edits.constraints_text == known:
        return CorrectedSession(folder, session, edits)
    mender, effects = Mender(session), []
    with context.report.stage("correcting"):
        for number, entry in enumerate(edits.entries, start=1):
            if isinstance(entry, Edit):
                continue
            try:
                effect = mender.add(entry).summary
            except RefusedConstraintError as error:
                raise UserError(f"Edit {number} on the map of {folder} is refused. {error}") from error
            context.announce(f"Edit {number}: {effect}")
            effects.append({"edit": number, "effect": effect})
    context.report.add("corrections", {str(folder): effects})
    bent = Deformation(session, mender.session())
    return CorrectedSession(folder, bent.after, edits.carried(bent.places), bent)
