from pathlib import Path

import pytest

from tests.checks.unexplained_constants import check, main


@pytest.mark.parametrize(
    "source",
    [
        "FAR = 3.0",
        'FAR = 3.0\n"""Metres."""',
        'FAR: float = 3.0\n"""Metres."""',
        'NEAR, FAR = 1.0, 3.0\n"""Metres."""\nOTHER = "because"',
    ],
)
def test_a_number_without_a_reason_is_listed(source: str, tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(source)
    assert len(list(check(tmp_path / "module.py"))) == 1
    assert main([str(tmp_path)]) == 1


@pytest.mark.parametrize(
    "source",
    [
        'FAR = 3.0\n"""Metres, because no room is larger."""',
        'FAR = 3.0\n"""Metres; a line\nthat breaks, so\nthat it is wide."""',
        'HALF = 0.5\n"""Olson, 2009, equation 3."""',
        'NAME = "far"',
        "IS_FAR = True",
        "def far() -> float:\n    return 3.0",
    ],
)
def test_reasons_and_other_values_are_not(source: str, tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(source)
    assert list(check(tmp_path / "module.py")) == []
    assert main([str(tmp_path)]) == 0
