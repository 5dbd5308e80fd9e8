"""What pages of a built site would load from other hosts: they are to be readable without a network.

Run as ``python tests/checks/foreign_resources.py build/docs``, it lists that, and fails if there is any.
"""

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

_LOADING = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href", "object": "data"}
"""Tags that load what an attribute names; links that readers click are not among them."""
_IN_STYLES = re.compile(r"(?:url\(|@import\s)\s*[\"']?((?:https?:)?//[^\"')\s;]+)")
_FOREIGN = re.compile(r"(?:https?:)?//")


class _Loaded(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.foreign: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        address = values.get(_LOADING.get(tag, ""), "") or ""
        if _FOREIGN.match(address) and values.get("rel") != "canonical":
            self.foreign.append(address)
        if "mermaid" in (values.get("class") or "").split():
            self.foreign.append("the theme's renderer of diagrams")


def foreign_resources(site: Path) -> Iterator[str]:
    """A line for each thing that a page or a style sheet below `site` would load from another host."""
    for path in sorted(site.rglob("*")):
        text = path.read_text(encoding="utf-8") if path.suffix in {".html", ".css"} else ""
        loaded = _Loaded()
        if path.suffix == ".html":
            loaded.feed(text)
        for address in [*loaded.foreign, *_IN_STYLES.findall(text)]:
            yield f"{path.relative_to(site)} loads {address}"


if __name__ == "__main__":
    found = list(foreign_resources(Path(sys.argv[1])))
    print("\n".join(found))
    sys.exit(bool(found))
