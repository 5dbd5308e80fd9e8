"""The secret in a page's address: kept for its user, and nobody else."""

import os
import stat
from pathlib import Path

import pytest

from racecar.pipelines.studio.server.secret import SECRET_FILE, page_secret


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where it is kept."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "racecar" / SECRET_FILE


def test_it_stays_the_same_in_a_file_of_its_user(file: Path) -> None:
    secret = page_secret()
    assert len(secret) >= 32
    assert page_secret() == secret == file.read_text()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert list(file.parent.iterdir()) == [file]


def test_every_user_has_another(file: Path) -> None:
    secret = page_secret()
    file.unlink()
    assert page_secret() != secret


def test_one_that_others_could_read_is_replaced(file: Path) -> None:
    secret = page_secret()
    file.chmod(0o644)
    assert page_secret() != secret
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


@pytest.mark.parametrize(
    "content", [b"", b"short", b"../../../../../../../../../../etc/", b"\xff" * 32, b"a" * 5000]
)
def test_what_is_no_secret_is_replaced(file: Path, content: bytes) -> None:
    file.parent.mkdir(parents=True)
    file.touch(0o600)
    file.write_bytes(content)
    secret = page_secret()
    assert secret == page_secret() == file.read_text()


def test_where_none_can_be_kept_each_page_has_its_own(file: Path, tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")
    assert page_secret() != page_secret()


def test_a_user_without_a_home_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setattr(Path, "home", no_home)
    assert len(page_secret()) >= 32


def test_a_pipe_in_its_place_holds_nobody_up(file: Path) -> None:
    file.parent.mkdir(parents=True)
    os.mkfifo(file)
    assert page_secret() == page_secret()
