"""All experiments on one self-contained page."""

from base64 import b64encode
from collections.abc import Iterator, Mapping
from html import escape

from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.page import FigureTable, Page, Picture

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; max-width: 56rem; margin: 2rem auto;
       padding: 0 1rem; }
p, nav, figure { max-width: 38rem; }
h1 { font-size: 1.7rem; }
h2 { font-size: 1.25rem; margin-top: 3rem; border-top: 1px solid #dfe3e8; padding-top: 1rem; }
figure { margin: 1.5rem 0; } figure img { width: 100%; height: auto; }
figcaption { color: #4a525a; font-size: 0.9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.85rem; margin: 1rem 0; }
caption { text-align: left; font-weight: 600; padding-bottom: 0.3rem; }
th, td { border-bottom: 1px solid #dfe3e8; padding: 0.25rem 0.7rem 0.25rem 0; text-align: left;
         white-space: nowrap; }
th { vertical-align: bottom; white-space: normal; }
#settings td { white-space: normal; vertical-align: top; }
nav ol { padding-left: 1.2rem; } a { color: #0072B2; }
"""


def html_report(experiments: Mapping[str, Page], settings: ExperimentSettings) -> str:
    """The page with embedded figures, so that a single file can be handed in."""
    contents = "\n".join(
        f'<li><a href="#{name}">{escape(result.title)}</a></li>' for name, result in experiments.items()
    )
    numbers = iter(range(1, 1000))
    sections = "\n".join(_section(name, result, numbers) for name, result in experiments.items())
    length = (
        "This is a quick run with few repetitions: enough to see that everything works, not to draw "
        "conclusions."
        if settings.quick
        else "Runs of the same seed give the same figures, except for measured times."
    )
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Experiments with the particle filter</title>
<style>{_STYLE}</style>
</head>
<body>
<h1>Experiments with the particle filter</h1>
<p>Made by <code>racecar experiment all</code> with seed {settings.seed}. {escape(length)}
In all figures blue is this library's filter (racecar) and vermillion the reference, a filter written plainly
as MIT's robotics course (RSS, lab 5) teaches it (course), unless their legend says otherwise.</p>
<nav><ol>
{contents}
</ol></nav>
{sections}
<section id="settings">
<h2>Settings of this library's filter</h2>
{_table(_settings(settings))}
</section>
</body>
</html>
"""


def _settings(settings: ExperimentSettings) -> FigureTable:
    given, fields = settings.localization, type(settings.localization).model_fields
    rows = [(name, f"{getattr(given, name):g}", field.description or "") for name, field in fields.items()]
    return FigureTable("", ("setting", "value", "meaning"), rows)


def _section(name: str, result: Page, numbers: Iterator[int]) -> str:
    paragraphs = "\n".join(f"<p>{escape(paragraph)}</p>" for paragraph in result.text)
    figures = "\n".join(_figure(picture, next(numbers)) for picture in result.pictures)
    tables = "\n".join(_table(table) for table in result.tables)
    headline = f"<h2>{escape(result.title)}</h2>"
    return f'<section id="{name}">\n{headline}\n{paragraphs}\n{figures}\n{tables}\n</section>'


def _figure(picture: Picture, number: int) -> str:
    image = b64encode(picture.svg).decode("ascii")
    shows = escape(picture.shows)
    return (
        f'<figure id="figure-{picture.name}"><img src="data:image/svg+xml;base64,{image}" alt="{shows}">'
        f"<figcaption>Figure {number}. {shows}</figcaption></figure>"
    )


def _table(table: FigureTable) -> str:
    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    rows = "\n".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    caption = f"<caption>{escape(table.title)}</caption>" if table.title else ""
    return (
        f'<div class="wide"><table>{caption}'
        f"<thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table></div>"
    )
