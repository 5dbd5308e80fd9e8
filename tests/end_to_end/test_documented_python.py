"""The Python that the docs show does what they say."""

from pathlib import Path

import pytest

from tests.checks.documentation import REPOSITORY, blocks

PAGE = REPOSITORY / "docs" / "reference" / "api.md"
EXAMPLES = [block.text for block in blocks(PAGE) if block.language == "python"]


def run(code: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    names: dict[str, object] = {}
    monkeypatch.chdir(folder)
    exec(compile(code, str(PAGE), "exec"), names)
    return names


def test_a_map_is_made(drive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = run(EXAMPLES[0], drive, monkeypatch)
    assert len(names["result"].trajectory) > 100  # type: ignore[attr-defined]


def test_a_car_is_localized(
    drive: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = run(EXAMPLES[1], drive, monkeypatch)
    assert names["estimate"].covariance.shape == (3, 3)  # type: ignore[attr-defined]
    assert "[" in capsys.readouterr().out
    assert len(EXAMPLES) == 2
