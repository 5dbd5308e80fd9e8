import os
from pathlib import Path

import pytest

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text


def test_lines_of_any_system(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes("ä\r\nb\rc\n".encode())
    assert read_text(tmp_path / "a.txt") == "ä\nb\nc\n"
    assert read_text(str(tmp_path / "a.txt"), 8) == "ä\nb\nc\n"


def test_what_has_no_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "endless.yaml").symlink_to("/dev/zero")
    with pytest.raises(UserError, match=r"endless\.yaml is longer than the 0\.1 MB"):
        read_text(tmp_path / "endless.yaml", 100_000)


def test_pipes_are_read_and_never_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "nobody")
    assert read_text(tmp_path / "nobody") == ""
    reading, writing = os.pipe()
    os.write(writing, b"t x y\n")
    os.close(writing)
    assert read_text(f"/dev/fd/{reading}") == "t x y\n"
    os.close(reading)


@pytest.mark.parametrize(("name", "complaint"), [("absent", "no such file"), (".", "is a directory")])
def test_what_cannot_be_read(tmp_path: Path, name: str, complaint: str) -> None:
    with pytest.raises(UserError, match=f"Cannot read .*: {complaint}"):
        read_text(tmp_path / name)
