"""The page and the figures of a batch, written again whenever another bag is done."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.batch.batch_page import Thumbnail, batch_page, map_thumbnail
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome
from racecar.pipelines.runs.mapping_job import MappingJob

PAGE, FIGURES = "batch.html", "batch.json"


class BatchResults:
    """A row for each job, in their order, and the files in the folder of the batch that show them."""

    def __init__(self, jobs: Sequence[MappingJob], out: Path, report: Report, made_by: str) -> None:
        """``made_by`` says on the page how the maps were made."""
        self._rows = {job.out: BatchRow(job, Outcome.WAITING, "Not mapped yet.") for job in jobs}
        self._thumbnails: dict[str, Thumbnail] = {}
        self._out, self._report, self._made_by = out, report, made_by

    @property
    def rows(self) -> list[BatchRow]:
        """In the order of the jobs."""
        return list(self._rows.values())

    def add(self, row: BatchRow) -> None:
        """What became of a job."""
        self._rows[row.job.out] = row
        thumbnail = map_thumbnail(row.job.out) if row.outcome.has_map else None
        if thumbnail is not None:
            self._thumbnails[row.name] = thumbnail

    def write(self) -> None:
        """Write page and figures, whole or not at all. Raises UserError when they cannot be written."""
        outcomes = Counter(row.outcome for row in self.rows)
        self._report.add("counts", {outcome.value: outcomes[outcome] for outcome in Outcome})
        self._report.add("bags", {row.name: row.as_dict() for row in self.rows})
        self._report.write(self._out / FIGURES)
        with write_atomically(self._out / PAGE) as partial:
            page = batch_page(self.rows, self._thumbnails, self._made_by)
            partial.write_text(page, encoding="utf-8", errors="replace")  # a path may be no text
