"""``racecar mend``: correct the map of a run by hand, on a page in the browser."""

from racecar.pipelines.commands.options import ConfigOption, QuietOption
from racecar.pipelines.commands.page_options import PageFlags
from racecar.pipelines.commands.rendering_options import RunArgument


def mend(
    *, run: RunArgument, served: PageFlags, config: ConfigOption = None, quiet: QuietOption = False
) -> None:
    """Correct the map of a run by hand, on a page in the browser: no bag is needed.

    The doubts of the verdict are a list of what to look at. A click shows the two passes that contradict
    each other; say whether they are at the same place, and the whole map follows, with its verdict, before
    you keep it. What is kept becomes constraints in edits.yaml, which every later rendering, merge and
    continuation applies. Ctrl-C ends it.

    Example: racecar mend runs/drive
    """
    from racecar.pipelines.commands.terminal import teller
    from racecar.pipelines.files.config_file import load_config

    settings = load_config(config)

    from racecar.pipelines.studio.studio import mend as mend_screen

    served.serve(lambda page: mend_screen(page, run, settings), settings, teller(quiet=quiet))
