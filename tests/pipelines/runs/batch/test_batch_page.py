"""The page of a batch."""

from pathlib import Path

import pytest
from PIL import Image

from racecar.pipelines.files.config_file import load_config
from racecar.pipelines.files.run_report import Consistency, Result, RunReport, ScanMatching
from racecar.pipelines.runs.batch.batch_page import batch_page, headline, map_thumbnail
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome
from racecar.pipelines.runs.mapping_job import MappingJob

ROWS = [
    BatchRow(
        MappingJob(Path(f"/bags/{name}.bag"), Path(f"/maps/{name}"), load_config(None)),
        outcome,
        reason,
        RunReport(
            result=Result(path_metres=12.345),
            consistency=Consistency(scan_matching=ScanMatching(mean_residual_m=0.0042)),
        ),
    )
    for name, outcome, reason in (
        ("a #1", Outcome.GOOD, ""),
        ("<b>", Outcome.DOUBTFUL, "Walls & wheels differ."),
        ("c", Outcome.FAILED, "It is cut."),
    )
]


def test_each_bag_has_a_row_with_what_became_of_it() -> None:
    page = batch_page(ROWS, {}, "Made by hand.")
    assert headline(ROWS) == "3 bags: 1 good, 1 doubtful, 1 failed"
    for words in (
        "<h1>3 bags: 1 good, 1 doubtful, 1 failed</h1>",
        "It is cut.",
        "12.3",
        "4.2",
        "Made by hand.",
    ):
        assert words in page
    assert 'href="a%20%231/"' in page
    assert 'href="c/"' not in page  # there is none
    assert "Walls &amp; wheels differ." in page
    assert "<b>" not in page


def test_the_map_is_on_the_page(tmp_path: Path) -> None:
    Image.new("L", (4000, 1000), 200).save(tmp_path / "map.pgm")
    thumbnail = map_thumbnail(tmp_path)
    assert thumbnail is not None
    assert thumbnail.shows == "map.pgm"  # without matplotlib there is no picture
    Image.new("RGB", (4000, 1000)).save(tmp_path / "map.png")
    thumbnail = map_thumbnail(tmp_path)
    assert thumbnail is not None
    page = batch_page(ROWS, {"c": thumbnail}, "")
    assert page.count("data:image/jpeg;base64,") == 1
    assert 'href="c/map.png"' in page


@pytest.mark.parametrize("content", [None, b"", b"P5\n99 99\n255\n"])
def test_a_map_that_cannot_be_drawn_leaves_its_place_empty(content: bytes | None, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "map.png").write_bytes(content)
    assert map_thumbnail(tmp_path) is None
