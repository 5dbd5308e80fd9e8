"""The Python that the docs show does what they say."""

from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from tests.checks.documentation import PAGES, REPOSITORY, blocks

API = REPOSITORY / "docs" / "reference" / "api.md"


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
