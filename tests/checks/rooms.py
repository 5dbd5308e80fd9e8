"""The rooms of the package and who imports whom: ``python tests/checks/rooms.py`` prints them.

A room is a folder at the top, or one of ``pipelines``.
Import-linter sees to it that no arrows close a circle.
"""

from collections import Counter

import grimp

MOST_ROOMS, MOST_ARROWS = 14, 60
"""What can still be drawn on one page, by judgement."""


def arrows() -> Counter[tuple[str, str]]:
    """Modules of the second room that modules of the first import, of each pair of rooms that has any."""
    graph = grimp.build_graph("racecar", cache_dir=None)
    imports = (
        (module, used) for module in graph.modules for used in graph.find_modules_directly_imported_by(module)
    )
    pairs = ((room(module), room(used)) for module, used in imports)
    return Counter((importing, used) for importing, used in pairs if importing and used and importing != used)


def room(module: str) -> str:
    """Of a module such as ``racecar.pipelines.bags.reader``: ``pipelines.bags``; empty outside of rooms."""
    _, *parts = module.split(".")
    return ".".join(parts[:2] if parts[:1] == ["pipelines"] else parts[:1])


if __name__ == "__main__":
    found = arrows()
    for (importing, used), count in sorted(found.items()):
        print(f"{importing} -> {used}: {count}")
    print(f"{len({name for pair in found for name in pair})} rooms, {len(found)} arrows")
