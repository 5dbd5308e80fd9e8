from pathlib import Path

import pytest

from tests.checks.room_imports import upward_imports


def test_tests_of_a_room_import_no_room_above_it() -> None:
    assert list(upward_imports(Path(__file__).parents[1])) == []


@pytest.mark.parametrize(
    ("statement", "goes_up"),
    [
        ("import racecar.pipelines.commands.cli", True),
        ("from racecar.localization.config import LocalizationConfig", True),
        ("from racecar import pipelines", True),
        ("def test():\n    from racecar.pipelines.commands import cli", True),
        ("from tests.simulated.mapped_drives import map_drive", True),
        ("from tests.pipelines import bag_samples", True),
        ("from benchmarks.replacements import replaced", True),
        ("from racecar.maps.geometry import se2", False),
        ("from tests.sensors.drives import drive", False),
        ("from tests.ros_domains import next_domain", False),
        ("import numpy", False),
    ],
)
def test_an_import_that_goes_up_is_found(statement: str, goes_up: bool, tmp_path: Path) -> None:
    (tmp_path / "mapping" / "graph").mkdir(parents=True)
    (tmp_path / "mapping" / "graph" / "test_x.py").write_text(statement)
    assert bool(list(upward_imports(tmp_path))) == goes_up


def test_whole_methods_may_import_all(tmp_path: Path) -> None:
    (tmp_path / "simulated").mkdir()
    (tmp_path / "simulated" / "test_x.py").write_text("import racecar.pipelines.commands.cli")
    assert list(upward_imports(tmp_path)) == []
