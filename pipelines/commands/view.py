"""``racecar view``: a run in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import QuietOption


def view(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="What `racecar map` or `racecar localize` has written.", show_default=False
        ),
    ],
    save: Annotated[
        Path | None,
        typer.Option(
            "--save", metavar="FILE", help="Write a rerun recording (.rrd) instead.", show_default=False
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            "--port",
            metavar="N",
            min=1,
            max=65535,
            help="Port of the page; a free one when not given.",
            show_default=False,
        ),
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    quiet: QuietOption = False,
) -> None:
    """Look at a run in the browser: map, path, scans, keyframes, loop closures and particles over time.

    Scans of every moment, and particles, are there when the run was made with --record. The page is served to
    this machine only, and needs no network. Ctrl-C ends it.

    Example: racecar view runs/drive
    """
    import signal
    import tempfile
    import webbrowser
    from contextlib import suppress
    from importlib.util import find_spec

    from rich.console import Console

    from racecar.maps.errors import UserError
    from racecar.maps.whole_files import write_atomically

    if find_spec("rerun") is None:
        raise UserError(
            "Looking at runs takes rerun, which needs Python 3.11 or newer: pip install rerun-sdk."
        )
    if not folder.is_dir():
        raise UserError(
            f"There is no folder {folder}; name one that `racecar map` or `racecar localize` wrote."
        )

    from racecar.pipelines.view.rerun_log import save_recording
    from racecar.pipelines.view.run_folder import load_run
    from racecar.pipelines.view.viewer_server import serve_viewer

    console = Console(quiet=quiet, highlight=False, soft_wrap=True)
    scene = load_run(folder)
    if save is not None:
        with write_atomically(save) as partial:
            save_recording(scene, partial)
        console.print(f"Wrote {save}; open it with: rerun {save}", markup=False)
        return
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # else the server would outlive a kill
    with tempfile.TemporaryDirectory() as temporary, suppress(KeyboardInterrupt):
        recording = Path(temporary) / "run.rrd"
        save_recording(scene, recording)
        with serve_viewer(recording, port) as (address, server):
            console.print(f"Look at {address} (Ctrl-C ends).", markup=False)
            if browser:
                webbrowser.open(address)
            server.wait()
