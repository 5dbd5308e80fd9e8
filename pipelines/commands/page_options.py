"""Flags of commands that serve a page, and the serving."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from racecar.pipelines.files.config_file import Config
    from racecar.pipelines.studio.page import Page
    from racecar.pipelines.studio.screen import Screen


@dataclass(frozen=True, kw_only=True)
class PageFlags:
    """Where the page is."""

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
    ] = 0
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True

    def serve(
        self,
        prepare: "Callable[[Page], Callable[[], Screen]]",
        settings: "Config",
        tell: Callable[[str], None],
    ) -> None:
        """Serve the screen that ``prepare`` makes, until Ctrl-C; ``tell`` receives the page's address.

        Ctrl-C asks first if something is not saved yet. SIGTERM and a closed terminal cannot, and save a
        discovered map.
        """
        import signal
        import webbrowser
        from contextlib import closing, suppress

        from racecar.pipelines.runs.interrupts import is_to_be_survived
        from racecar.pipelines.studio.page import Page
        from racecar.pipelines.studio.studio import add_opening

        with closing(Page("racecar studio", self.port)) as page, suppress(KeyboardInterrupt):
            for number in (signal.SIGTERM, signal.SIGHUP):
                if not is_to_be_survived(number):
                    signal.signal(number, lambda *_: page.stop())
            page.enter(prepare(page))
            add_opening(page, settings)
            tell(f"Look at {page.address} (Ctrl-C ends).")
            if self.browser:
                webbrowser.open(page.address)
            _run(page)


def _run(page: "Page") -> None:
    """Work until Ctrl-C, and on after the first one if something is not saved yet; otherwise until `stop`."""
    from racecar.maps.errors import UserError
    from racecar.pipelines.commands.terminal import teller

    tell = teller(quiet=False)
    while True:
        try:
            page.run()
            if saved := page.rescue():
                tell(saved)
        except KeyboardInterrupt:
            try:
                page.confirm_leaving()
            except UserError as loss:
                tell(str(loss))
                continue
        return
