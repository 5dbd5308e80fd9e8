"""Pages that load something from other hosts are noticed."""

from pathlib import Path

import pytest

from tests.checks.foreign_resources import foreign_resources


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.html", '<script src="https://example.org/a.js"></script>'),
        ("a.html", '<link href="https://fonts.example.org/a" rel="preconnect">'),
        ("a.html", '<img src="//example.org/a.png">'),
        ("a.html", "<style>@import 'https://example.org/a.css';</style>"),
        ("a.html", '<pre class="mermaid"><code>flowchart LR</code></pre>'),
        ("a.css", "@font-face { src: url(https://example.org/a.woff2) }"),
    ],
)
def test_what_is_loaded_from_elsewhere_is_found(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert len(list(foreign_resources(tmp_path))) == 1


def test_links_to_click_and_local_files_are_none(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<a href="https://example.org">there</a><script src="../assets/a.js"></script>'
        '<math xmlns="http://www.w3.org/1998/Math/MathML"></math><img src="a.png">'
    )
    (tmp_path / "a.css").write_text("@import 'b.css'; p { background: url(a.png) }")
    assert list(foreign_resources(tmp_path)) == []
