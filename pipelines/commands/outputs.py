"""Mark the parameters of a command that name outputs, and check these before the command begins.

A parameter is marked in its annotation, as in ``Annotated[Path, typer.Option("--json"), WritesFile()]``.
Every other path is an input. A command with outputs also has the flag --replace.
"""

import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args

import typer

if TYPE_CHECKING:
    from racecar.pipelines.runs.output_places import OutputPlace

Flags: TypeAlias = Mapping[str, Any]
"""The values of a command's parameters by name."""

ReplaceOption = Annotated[
    bool,
    typer.Option(
        "--replace",
        help="Replace what is there: results of an earlier run, or files that this command did not write, "
        "which are kept as NAME.kept in folders; never a recording, nor what is read.",
    ),
]


@dataclass(frozen=True)
class WritesFile:
    """The parameter names a file to write."""

    suffix: str = ""
    """Required suffix of the name."""

    def place(self, path: Path, flags: Flags, command: str) -> "OutputPlace":
        """The output place to check."""
        from racecar.pipelines.runs.output_places import OutputFile

        return OutputFile(path, command, self.suffix)


@dataclass(frozen=True)
class WritesFolder:
    """The parameter names a folder to write into."""

    names: Callable[[Flags], Collection[str]]
    """Names of the files and folders that the command writes there."""
    remakes: Callable[[Flags], Path | None] = lambda flags: None
    """The folder that may be the same, and is the default: the command replaces the results that it reads."""

    def place(self, path: Path, flags: Flags, command: str) -> "OutputPlace":
        """The output place to check."""
        from racecar.pipelines.runs.output_places import OutputFolder

        remade = self.remakes(flags)
        return OutputFolder(path, partial(self.names, flags), () if remade is None else (remade,))


@dataclass(frozen=True)
class WritesBag:
    """The parameter names a bag to write."""

    def place(self, path: Path, flags: Flags, command: str) -> "OutputPlace":
        """The output place to check, with the true path that is written beside it."""
        from racecar.pipelines.runs.output_places import OutputBag
        from racecar.pipelines.simulation.simulator import ground_truth_file

        return OutputBag(path, command, (ground_truth_file(path),))


Writes: TypeAlias = WritesFile | WritesFolder | WritesBag


def written_parameters(command: Callable[..., Any]) -> dict[str, Writes]:
    """The parameters of a command that name outputs."""
    return {
        name: mark
        for name, parameter in inspect.signature(command).parameters.items()
        for mark in get_args(parameter.annotation)
        if isinstance(mark, Writes)
    }


def checked(command: Callable[..., Any], title: str) -> Callable[..., Any]:
    """Wrap a command, called ``title``, so that it checks its outputs first, if it has any.

    The check raises UserError before any work is done. The command receives the flag --replace, too, if it
    has a parameter ``replace``.
    """
    written, signature = written_parameters(command), inspect.signature(command)
    if not written:
        return command

    @wraps(command)
    def check_and_run(*, replace: bool, **flags: Any) -> Any:
        places = [
            mark.place(path, flags, title)
            for name, mark in written.items()
            if (path := flags[name] or _by_default(mark, flags)) is not None
        ]
        if places:
            read = [path for name, value in flags.items() if name not in written for path in _paths(value)]
            check(places, read, replace=replace)
        return command(**flags, **({"replace": replace} if "replace" in signature.parameters else {}))

    replace = inspect.Parameter(
        "replace", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=ReplaceOption
    )
    parameters = {**signature.parameters, "replace": replace}
    check_and_run.__signature__ = signature.replace(  # type: ignore[attr-defined]  # which typer reads
        parameters=list(parameters.values())
    )
    return check_and_run


def check(places: "Sequence[OutputPlace]", read: Sequence[Path], *, replace: bool) -> None:
    """Raises UserError that names the flag when something would be replaced unasked."""
    from racecar.pipelines.runs.output_places import OccupiedError, check_places

    try:
        check_places(places, read, replace=replace)
    except OccupiedError as error:
        raise error.or_else("replace it with --replace") from error


def _by_default(mark: Writes, flags: Flags) -> Path | None:
    return mark.remakes(flags) if isinstance(mark, WritesFolder) else None


def _paths(value: object) -> Sequence[Path]:
    values = value if isinstance(value, list | tuple) else [value]
    return [each for each in values if isinstance(each, Path)]
