"""Result folders that appear complete or not at all: written to a temporary folder and moved at the end."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.whole_files import cannot_write, remove_abandoned, staging_folder
from racecar.maps.whole_folders import begin_replacing, finish_replacing, names_in
from racecar.pipelines.files.written_files import keep_changed, record_written

_written: dict[Path, tuple[str, ...]] = {}
"""What this process last wrote to each folder."""


@contextmanager
def output_folder(path: Path) -> Iterator[Path]:
    """A `whole_folder` for the results of a run. What another program wrote or changed there is kept under
    another name, and the run's report records the digests of the new files."""
    with whole_folder(path) as staging:
        yield staging
        try:
            keep_changed(path, staging)
            record_written(path, staging)
        except OSError as error:
            raise cannot_write(path, error) from error


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder to write into; on success its files move into `path`, replacing their namesakes.

    Other files in `path` stay. On an error, or Ctrl-C, `path` is unchanged. Raises UserError at once when
    `path` cannot be written to, before any work is done.
    """
    if os.path.lexists(path) and not path.is_dir():
        raise UserError(f"{path} is a file; name a folder to write to.")
    finish_replacing(path)
    parents = path.absolute().parents
    for folder in parents:  # a run without a folder yet is staged in one of these
        remove_abandoned(folder)
    home = next(folder for folder in [path, *parents] if folder.is_dir())
    with staging_folder(home, path) as staging:
        yield staging
        names = names_in(staging)
        try:
            begin_replacing(path, staging)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise cannot_write(path, error) from error
    finish_replacing(path)
    _written[path.absolute()] = names


def written_to(path: Path) -> tuple[str, ...]:
    """Names of what this process last wrote to an output folder; folder names end in a slash."""
    return _written.get(path.absolute(), ())
