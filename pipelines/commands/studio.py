"""``racecar studio``: everything on one page in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import QuietOption


def studio(
    target: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="What `racecar map` or `racecar localize` has written.", show_default=False
        ),
    ],
    port: Annotated[
        int,
        typer.Option(
            "--port",
            metavar="N",
            min=0,
            max=65535,
            help="Port of the page. By default a free one.",
            show_default=False,
        ),
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    quiet: QuietOption = False,
) -> None:
    """Look at a run in the browser: map, path, scans, keyframes, loop closures and particles over time.

    Scans of every moment, and particles, are there when the run was made with --record. The page is served to
    this machine only, and needs no network. Ctrl-C ends it.

    Example: racecar studio runs/drive
    """
    import signal
    import webbrowser
    from contextlib import closing, suppress

    from rich.console import Console

    from racecar.pipelines.studio.page import Page
    from racecar.pipelines.studio.studio import room_for

    console = Console(quiet=quiet, highlight=False, soft_wrap=True)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with closing(Page("racecar studio", port)) as page, suppress(KeyboardInterrupt):
        page.enter(room_for(page, target))
        console.print(f"Look at {page.address} (Ctrl-C ends).", markup=False)
        if browser:
            webbrowser.open(page.address)
        page.run()
