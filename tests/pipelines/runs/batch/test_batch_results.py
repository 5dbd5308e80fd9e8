"""What is shown of a batch follows its list, whatever is done first."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.batch.batch_results import FIGURES, PAGE, BatchResults
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome
from tests.pipelines.runs.batch.test_batch_run import jobs

NAMES = ("c", "a", "b")


@pytest.mark.parametrize("done", [(0, 1, 2), (2, 0), (1,)])
def test_rows_stay_in_the_order_of_the_list(tmp_path: Path, done: tuple[int, ...]) -> None:
    listed = jobs(tmp_path, *NAMES)
    results = BatchResults(listed, tmp_path, Report("racecar map --batch"), "Made by hand.")
    results.write()
    for number in done:
        results.add(BatchRow(replace(listed[number]), Outcome.FAILED, "It is broken."))
        results.write()
    assert [row.name for row in results.rows] == list(NAMES)
    assert list(json.loads((tmp_path / FIGURES).read_text())["bags"]) == list(NAMES)
    page = (tmp_path / PAGE).read_text()
    assert sorted(NAMES, key=lambda name: page.index(f'<td class="bag">{name}<')) == list(NAMES)
