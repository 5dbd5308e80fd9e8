from pathlib import Path

import pytest

from racecar.maps.errors import UserError
from racecar.maps.whole_files import write_atomically


def test_file_is_replaced_on_success_only(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "figures.json"
    with write_atomically(path) as partial:
        assert partial.suffix == ".json"
        partial.write_text("first")
    with pytest.raises(ValueError), write_atomically(path) as partial:
        partial.write_text("second")
        raise ValueError
    assert path.read_text() == "first"
    assert [file.name for file in path.parent.iterdir()] == ["figures.json"]


def test_file_that_is_a_folder(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is a folder"), write_atomically(tmp_path):
        pass
