"""Runs whose maps are wrong, to be corrected by hand."""

from pathlib import Path

from racecar.mapping.session.session import Session
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.session_file import save_session
from tests.mapping.mending.bent import two_laps
from tests.mapping.mending.test_mender import with_wrong_loop


def unclosed() -> Session:
    """Two laps that do not meet, since no loop was closed."""
    return two_laps(turn=0.001)


def wrongly_closed() -> Session:
    """Two laps with a loop between two places."""
    return with_wrong_loop(two_laps(turn=0.0), 10, 80)


def run_of(session: Session, folder: Path) -> Path:
    """A run in a folder, as ``racecar render`` writes it."""
    source = folder.parent / "source"
    source.mkdir()
    save_session(session, source / "session.npz")
    assert run(["render", str(source), "--out", str(folder), "--quiet"]) == 0
    return folder
