"""``python -m benchmarks``: a command for each benchmark."""

import typer

from benchmarks.ablation.ablation import ablation
from benchmarks.accuracy.accuracy import accuracy
from benchmarks.harness.command import TITLE, as_command
from benchmarks.live.live import live
from benchmarks.localizer.localizer import localizer
from benchmarks.quality.quality import quality
from benchmarks.slam.growth import growth
from benchmarks.slam.slam import slam
from benchmarks.worlds.worlds import worlds
from racecar.pipelines.commands import cli

app = typer.Typer(pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]})


@app.callback()
def _describe() -> None:
    """Measure what the documentation states: accuracy, time and memory."""


for _benchmark in (slam, growth, worlds, quality, localizer, accuracy, ablation, live):
    app.command()(as_command(_benchmark))
cli.complete(app, TITLE)


def run(arguments: list[str]) -> int:
    """Run one benchmark and return its exit code; errors become one sentence on stderr."""
    return cli.run(arguments, app, TITLE)
