"""A process that corrects the map of a run, so that the page stays responsive meanwhile."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.runs.other_process import FreshProcess, ProcessDiedError, leave_terminal_alone
from racecar.pipelines.studio.mend.corrector import Corrector

Work = Callable[[Corrector], Any]
"""Something to do, which can be pickled, as can its result."""


class CorrectingProcess:
    """Does one thing after the other."""

    def __init__(self, run: Path, config: MappingConfig) -> None:
        """Start on the run in a folder; ``config`` sets how its map is rendered and judged."""
        self._make = partial(_correct, run, config)
        self._process: FreshProcess[None] | None = None
        self._pipe: Connection | None = None
        self.is_busy = False
        """Whether an answer is to come."""

    def ask(self, work: Work) -> None:
        """Have something done; the process is started when it does not run."""
        if self._pipe is None:
            self._pipe, other_end = Pipe()
            self._process = FreshProcess(partial(self._make, other_end))
            other_end.close()  # the process has its own
        self._pipe.send(work)
        self.is_busy = True

    def answer(self) -> Any:
        """The result of what was asked; None while it is not there.

        Raises UserError of the work, what the process died of, and UserError when it was killed.
        """
        if self._pipe is None or not self.is_busy or not self._pipe.poll():
            return None
        self.is_busy = False
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            answer = self._cause_of_death()
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
        if self._pipe is not None:
            self._pipe.close()
        self._process = self._pipe = None
        self.is_busy = False

    def _cause_of_death(self) -> Exception:
        process, self._process, self._pipe = self._process, None, None
        try:
            assert process is not None
            process.result()
        except ProcessDiedError:
            return UserError(
                "The process that corrects the map was ended from outside, as the system does when memory "
                "runs out. What is kept is still there: try again while less else is running."
            )
        except Exception as error:
            return error
        return ProcessDiedError(0)


def _correct(run: Path, config: MappingConfig, pipe: Connection) -> None:
    leave_terminal_alone()
    corrector = Corrector(load_session(run), config)
    with suppress(EOFError):  # the page has gone
        while True:
            work: Work = pipe.recv()
            try:
                answer = work(corrector)
            except UserError as error:
                answer = error
            pipe.send(answer)
