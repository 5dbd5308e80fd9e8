"""Warnings for the person at the terminal."""

from collections.abc import Iterable

from rich.console import Console


def print_warnings(sentences: Iterable[str]) -> None:
    """One line each, on stderr."""
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    for sentence in sentences:
        console.print(f"Warning: {sentence}", style="yellow", markup=False)
