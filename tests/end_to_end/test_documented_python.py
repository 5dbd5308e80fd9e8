"""The Python that the docs show does what they say."""

import ast
import json
import os
import sys
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
from mypy import api as mypy

from tests.checks.documentation import PAGES, REPOSITORY, blocks

API = REPOSITORY / "docs" / "reference" / "api.md"
NOTEBOOK = REPOSITORY / "docs" / "quick-start.ipynb"


def examples(page: Path) -> list[str]:
    return [block.text for block in blocks(page) if block.language == "python"]


@pytest.fixture(scope="module")
def names(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the blocks of the page of the API, run one after the other beside a bag, leave behind."""
    folder = copytree(drive, tmp_path_factory.mktemp("documented") / "drive")
    found: dict[str, Any] = {"folder": folder}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("MPLBACKEND", "agg")
        for code in examples(API):
            exec(compile(code, str(API), "exec"), found)
    return found


def test_other_pages_show_none_or_the_same() -> None:
    readme = REPOSITORY / "README.md"
    assert [page for page in PAGES if examples(page)] == [readme, API]
    assert examples(readme) == examples(API)[:1]


def test_a_bag_is_mapped_and_localized_at_once(names: dict[str, Any]) -> None:
    assert (names["folder"] / "runs" / "drive" / "map.png").exists()
    assert (names["folder"] / "runs" / "localized" / "overlay.png").exists()
    assert names["drive"].quality.summary.startswith("The drive is localized")
    assert names["metres"] > 1.0
    assert len(names["occupied"]) > 100
    assert names["both"].result.counts["keyframes_of_earlier_drives"] > 0
    assert names["coarse"].grid.resolution == 0.1


def test_an_error_is_the_sentence_that_the_command_prints(names: dict[str, Any]) -> None:
    with pytest.raises(names["racecar"].UserError, match=r"no_such\.bag"):
        names["racecar"].map_bag("no_such.bag")


def test_message_by_message(names: dict[str, Any]) -> None:
    assert len(names["result"].trajectory) > 100
    assert names["estimate"].covariance.shape == (3, 3)


@pytest.mark.slow  # mypy analyzes the whole package, unless its cache is filled
def test_the_examples_have_the_right_types(tmp_path: Path) -> None:
    path = tmp_path / "examples.py"
    path.write_text("\n".join(examples(API)), encoding="utf-8")
    found, errors, _ = mypy.run(["--config-file", str(REPOSITORY / "pyproject.toml"), str(path)])
    assert found.startswith("Success"), found + errors


def cells() -> list[str]:
    """The code of the notebook, by cell."""
    contents = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    return ["".join(cell["source"]) for cell in contents["cells"] if cell["cell_type"] == "code"]


def test_the_notebook_runs_and_shows_its_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    names: dict[str, Any] = {}
    shown = [in_notebook(code, names) for code in cells()]
    assert sum(hasattr(each, "_repr_html_") for each in shown) == 2
    assert names["walls"].shape[1] == 2 and len(names["walls"]) > 100
    assert names["drive"].quality.verdict.value == "localized"
    assert "0.27 if these are millimetres" in capsys.readouterr().out


def in_notebook(code: str, names: dict[str, Any]) -> object:
    """Run a cell; the value of its last line is what a notebook shows."""
    *others, last = ast.parse(code).body
    if not isinstance(last, ast.Expr):
        exec(compile(code, str(NOTEBOOK), "exec"), names)
        return None
    exec(compile(ast.Module(others, []), str(NOTEBOOK), "exec"), names)
    return eval(compile(ast.Expression(last.value), str(NOTEBOOK), "eval"), names)
