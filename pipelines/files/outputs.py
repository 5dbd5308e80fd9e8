"""Folders of results appear whole or not at all: written beside their place and moved at the end."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.whole_files import cannot_write, move_into_place, staging_folder

_written: dict[Path, tuple[str, ...]] = {}
"""What this process last wrote to each folder."""


@contextmanager
def output_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder to write into; on success its files move into `path`, replacing their namesakes.

    Other files in `path` stay. On an error, or Ctrl-C, `path` is as it was. Raises UserError at once when
    `path` cannot be written to, so that no work is done in vain.
    """
    if path.exists() and not path.is_dir():
        raise UserError(f"{path} is a file; name a folder to write to.")
    home = next(folder for folder in [path, *path.absolute().parents] if folder.is_dir())
    with staging_folder(home, path) as staging:
        yield staging
        names = sorted(f"{each.name}/" if each.is_dir() else each.name for each in staging.iterdir())
        _move_files(staging, path)
        _written[path.absolute()] = tuple(names)


def written_to(path: Path) -> tuple[str, ...]:
    """The names of what this process last wrote to an output folder; those of folders end in a slash."""
    return _written.get(path.absolute(), ())


def _move_files(source: Path, destination: Path) -> None:
    from racecar.pipelines.files.report import REPORT_FILE  # loads NumPy, which the command line does without

    try:
        for folder, _, names in os.walk(
            source, topdown=False
        ):  # so that the report, which is on top, is last
            target = destination / Path(folder).relative_to(source)
            target.mkdir(parents=True, exist_ok=True)
            for name in sorted(names, key=lambda name: name == REPORT_FILE):
                move_into_place(Path(folder, name), target / name)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise cannot_write(destination, error) from error
