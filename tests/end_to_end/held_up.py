"""``racecar``, held up where it calls a function, so that a test meets it there.

Its first argument says in JSON: ``where`` as module:name, the ``nth`` call, for how many ``seconds``, whether
``each`` call since is, and the file ``reached`` that is made then.
"""

import json
import sys
import time
from functools import reduce
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

from racecar.mapping import warm_up
from racecar.pipelines.commands.cli import main
from racecar.pipelines.live.ros.start import start_ros


def hold_up(where: str, nth: int, seconds: float, each: bool, reached: str) -> None:
    module, _, name = where.partition(":")
    if module != warm_up.__name__:  # whose calls are not to be counted
        warm_up.warm_up()
        warm_up.warm_up = lambda: None
    *owners, last = name.split(".")
    owner = reduce(getattr, owners, import_module(module))
    work, calls = getattr(owner, last), count(1)

    def held(*arguments: Any, **named: Any) -> Any:
        number = next(calls)
        if number == nth or (each and number > nth):
            Path(reached).touch()
            time.sleep(seconds)
        return work(*arguments, **named)

    setattr(owner, last, held)


if __name__ == "__main__":
    start_ros()
    hold_up(**json.loads(sys.argv[1]))
    del sys.argv[1]
    main()
