"""Progress of long work: a bar on a terminal, except with ``--quiet``, and any other listener."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

Listener = Callable[[str, float], None]
"""Receives a description of the work and its completed share, 0 to 1."""


def nobody_listens(_description: str, _share: float) -> None:
    """Listener for work whose progress only a terminal shows."""


@contextmanager
def progress_bar(
    description: str, total: float = 1.0, *, quiet: bool = False, listen: Listener = nobody_listens
) -> Iterator[Callable[[float], None]]:
    """Yield a function to call with how much of `total` is done so far."""
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=quiet or not console.is_terminal,
    )
    with bar:
        task = bar.add_task(description, total=total)

        def advance_to(done: float) -> None:
            bar.update(task, completed=done)
            listen(description, min(done / total, 1.0) if total else 1.0)

        listen(description, 0.0)
        yield advance_to
