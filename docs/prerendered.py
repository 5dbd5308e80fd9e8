"""Formulas and diagrams become part of the pages when they are built: readers need no script and no network.

mkdocs calls `on_page_content` with the HTML of each page.
"""

import html
import re

import latex2mathml.converter
import mermaidx
from mkdocs.exceptions import PluginError

_INLINE_FORMULA = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
_FORMULA = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
_DIAGRAM = re.compile(r'<pre class="mermaid"><code>(.*?)</code></pre>', re.DOTALL)


def on_page_content(content: str, **_: object) -> str:
    """A page's HTML with MathML for LaTeX, and SVG for Mermaid."""
    content = _INLINE_FORMULA.sub(lambda found: _mathml(found[1], "inline"), content)
    content = _FORMULA.sub(lambda found: _mathml(found[1], "block"), content)
    return _DIAGRAM.sub(lambda found: _svg(found[1]), content)


def _mathml(latex: str, display: str) -> str:
    mathml = latex2mathml.converter.convert(html.unescape(latex), display=display)
    if unknown := re.findall(r"\\\w+", mathml):
        raise PluginError(f"The formula {latex} needs {unknown[0]}, which latex2mathml does not know.")
    return mathml


def _svg(diagram: str) -> str:
    """Not of the class ``mermaid``: the theme's script would fetch its own renderer."""
    return f'<div class="diagram">{mermaidx.render(html.unescape(diagram)).svg()}</div>'
