import errno
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from racecar.maps.errors import UserError
from racecar.maps.whole_files import staging_folder, write_atomically


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_file_is_replaced_on_success_only(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "figures.json"
    with write_atomically(path) as partial:
        assert partial.suffix == ".json"
        partial.write_text("first")
        assert not path.exists()
    with pytest.raises(ValueError), write_atomically(path) as partial:
        partial.write_text("second")
        raise ValueError
    assert path.read_text() == "first"
    assert names(path.parent) == ["figures.json"]


def test_file_that_is_a_folder(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is a folder"), write_atomically(tmp_path):
        pass


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "latest.json").symlink_to("real/figures.json")
    for text in ("made", "replaced"):
        with write_atomically(tmp_path / "latest.json") as partial:
            partial.write_text(text)
        assert (tmp_path / "latest.json").is_symlink()
        assert (tmp_path / "real" / "figures.json").read_text() == text
    assert names(tmp_path / "real") == ["figures.json"]


def test_a_pipe_is_written_into(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    heard: list[str] = []
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(reader, True)
    listener = threading.Thread(target=lambda: heard.append(os.read(reader, 100).decode()))
    with write_atomically(pipe) as partial:
        partial.write_text("figures")
    listener.start()
    listener.join()
    os.close(reader)
    assert heard == ["figures"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert names(tmp_path) == ["pipe"]


def test_a_pipe_that_nobody_reads_is_told(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with (
        pytest.raises(UserError, match=r"Cannot write to .*pipe"),
        write_atomically(tmp_path / "pipe") as partial,
    ):
        partial.write_text("figures")


WRITE_TO_OUTPUT = """
from pathlib import Path
from racecar.maps.whole_files import write_atomically
print("before")
with write_atomically(Path("/dev/stdout")) as partial:
    partial.write_text("figures\\n")
print("after")
"""


def test_the_output_is_written_into_in_its_turn(tmp_path: Path) -> None:
    command = [sys.executable, "-c", WRITE_TO_OUTPUT]
    piped = subprocess.run(command, capture_output=True, text=True, check=True)
    assert piped.stdout == "before\nfigures\nafter\n"
    with (tmp_path / "out.txt").open("w") as out:
        subprocess.run(command, stdout=out, check=True)
    assert (tmp_path / "out.txt").read_text() == "before\nfigures\nafter\n"
    assert names(tmp_path) == ["out.txt"]


def test_a_full_disk_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"full\.json: no space left on device; choose"):
        (tmp_path / "full.json").symlink_to("/dev/full")
        with write_atomically(tmp_path / "full.json") as partial:
            partial.write_text("figures")
    with (
        pytest.raises(UserError, match=r"a\.json: no space left"),
        write_atomically(tmp_path / "a.json"),
    ):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert names(tmp_path) == ["full.json"]


ABANDON = """
import os, sys
from pathlib import Path
from racecar.maps.whole_files import staging_folder
with staging_folder(Path(sys.argv[1]), Path("run")) as folder:
    (folder / "half").write_text("done")
    print(folder.name, flush=True)
    sys.stdin.read(1)
    os.kill(os.getpid(), 9)
"""


def test_what_a_killed_run_left_is_removed_and_what_is_in_use_stays(tmp_path: Path) -> None:
    other = subprocess.Popen(
        [sys.executable, "-c", ABANDON, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert other.stdout is not None
    assert other.stdin is not None
    theirs = other.stdout.readline().strip()
    (tmp_path / ".racecar-notes").write_text("a file of that name")
    with staging_folder(tmp_path, tmp_path / "run") as ours:
        assert names(tmp_path) == sorted([ours.name, theirs, ".racecar-notes"])
    assert (tmp_path / theirs / "half").exists()
    other.communicate("x")
    assert names(tmp_path) == sorted([theirs, ".racecar-notes"])
    with staging_folder(tmp_path, tmp_path / "run") as ours:
        assert names(tmp_path) == sorted([ours.name, ".racecar-notes"])
    assert names(tmp_path) == [".racecar-notes"]
