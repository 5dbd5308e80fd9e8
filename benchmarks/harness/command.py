"""A benchmark as a command: the common options, and the output of the figures."""

from collections.abc import Callable
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

from benchmarks.harness.bench import Bench
from racecar.pipelines.commands.options import ConfigOption, JsonOption, QuietOption, SeedOption

TITLE = "python -m benchmarks"
_OF_ALL: dict[str, tuple[Any, Any]] = {
    "config": (ConfigOption, None),
    "seed": (SeedOption, 0),
    "json": (JsonOption, None),
    "quiet": (QuietOption, False),
}


def as_command(benchmark: Callable[..., None]) -> Callable[..., None]:
    """A benchmark, which takes a `Bench` and its own options, in the form that typer calls."""

    @wraps(benchmark)
    def command(*, config: Path | None, seed: int, json: Path | None, quiet: bool, **own: Any) -> None:
        from racecar.pipelines.commands.results import where_figures_are
        from racecar.pipelines.commands.tables import page
        from racecar.pipelines.files.config_file import load_config
        from racecar.pipelines.files.report import Report

        settings = load_config(config)
        report = Report(f"{TITLE} {benchmark.__name__}")
        report.add("inputs", {**own, "config": config, "seed": seed, "settings": settings.model_dump()})
        bench = Bench(settings, seed, report, quiet=quiet, width=page().width)
        benchmark(bench, **own)
        if json is not None:
            report.write(json)
            bench.page.print(where_figures_are(json), markup=False, soft_wrap=True)

    own = list(signature(benchmark).parameters.values())[1:]
    shared = [
        Parameter(name, Parameter.KEYWORD_ONLY, annotation=kind, default=default)
        for name, (kind, default) in _OF_ALL.items()
    ]
    parameters = [each.replace(kind=Parameter.KEYWORD_ONLY) for each in own] + shared
    command.__signature__ = signature(command).replace(parameters=parameters)  # type: ignore[attr-defined]
    return command
