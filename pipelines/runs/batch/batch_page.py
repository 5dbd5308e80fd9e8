"""A batch as one self-contained page: a row for each bag, with a thumbnail of its map."""

from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO
from pathlib import Path
from urllib.parse import quote

from PIL import Image

from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1b1f24; max-width: 84rem; margin: 2rem auto;
       padding: 0 1rem; }
h1 { font-size: 1.6rem; margin-bottom: 0.2rem; }
.note { color: #4a525a; margin: 0 0 1.2rem; max-width: 60rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; }
th, td { border-bottom: 1px solid #dfe3e8; padding: 0.5rem 0.8rem 0.5rem 0; text-align: left;
         vertical-align: top; }
th { font-weight: 600; font-size: 0.85rem; vertical-align: bottom; }
.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.picture { width: 200px; } .picture img { display: block; max-width: 200px; max-height: 150px; }
.bag { min-width: 8rem; } .path { color: #4a525a; font-size: 0.8rem; overflow-wrap: anywhere; }
.why { min-width: 14rem; overflow-wrap: anywhere; }
.why p { margin: 0 0 0.3rem; } .warning { color: #4a525a; font-size: 0.85rem; }
.verdict { display: inline-block; padding: 0 0.5rem; border-radius: 0.6rem; font-weight: 600; }
.good { background: #d5efe5; color: #00523b; } .doubtful { background: #fbe7b8; color: #5c4300; }
.wrong, .failed { background: #f8d6c6; color: #7a2b00; } .waiting { background: #e6e9ed; color: #3b434b; }
a { color: #0072B2; }
"""
_NUMBERS = (
    *("path<br>(m)", "drive<br>(s)", "off per<br>10 m (m)", "off in<br>all (m)"),
    *("residual<br>(mm)", "loops", "took<br>(s)"),
)
_MOST_PIXELS = (400, 300)
"""Twice the displayed size, for high-resolution screens; about 15 kB as JPEG."""


@dataclass(frozen=True)
class Thumbnail:
    """A thumbnail and the file it shows."""

    shows: str
    """Name of a file in the run's folder."""
    jpeg: bytes


def map_thumbnail(folder: Path) -> Thumbnail | None:
    """Thumbnail of map.png, or of the map itself if there is no picture; None if there is neither."""
    for name in ("map.png", "map.pgm"):
        try:
            with Image.open(folder / name) as image:
                small = image.convert("RGB")
        except (OSError, Image.DecompressionBombError):
            continue
        small.thumbnail(_MOST_PIXELS)
        jpeg = BytesIO()
        small.save(jpeg, format="JPEG", quality=80)
        return Thumbnail(name, jpeg.getvalue())
    return None


def batch_page(rows: Sequence[BatchRow], thumbnails: Mapping[str, Thumbnail], made_by: str) -> str:
    """The page as HTML. Links are relative to the folder that contains the runs' folders. ``thumbnails`` are
    keyed by the rows' names, and ``made_by`` describes how the maps were made."""
    numbers = "".join(f'<th class="number">{name}</th>' for name in _NUMBERS)
    body = "\n".join(_row(row, thumbnails.get(row.name)) for row in rows)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(headline(rows))}</title>
<style>{_STYLE}</style>
</head>
<body>
<h1>{escape(headline(rows))}</h1>
<p class="note">{escape(made_by)} <em>Off per 10 m</em> and <em>in all</em> are the errors to expect between
places 10 m of path apart and over the whole map; <em>residual</em> is by how much the scan matches
disagree with the map on average.</p>
<div class="wide"><table>
<thead><tr><th>map</th><th>bag</th><th>verdict</th>{numbers}<th>remarks</th></tr></thead>
<tbody>
{body}
</tbody></table></div>
</body>
</html>
"""


def headline(rows: Sequence[BatchRow]) -> str:
    """Number of bags, and of each outcome."""
    counts = Counter(row.outcome for row in rows)
    parts = [f"{counts[outcome]} {outcome.value}" for outcome in Outcome if counts[outcome]]
    return f"{len(rows)} {'bag' if len(rows) == 1 else 'bags'}: {', '.join(parts)}"


def shown(value: float | None, decimals: int) -> str:
    """A number as text, empty for None."""
    return "" if value is None else f"{value:.{decimals}f}"


def _row(row: BatchRow, thumbnail: Thumbnail | None) -> str:
    folder, name = f"{quote(row.name)}/", escape(row.name)
    picture = ""
    if thumbnail is not None:
        source = f"data:image/jpeg;base64,{b64encode(thumbnail.jpeg).decode('ascii')}"
        picture = f'<a href="{folder}{thumbnail.shows}"><img src="{source}" alt="The map of {name}"></a>'
    title = f'<a href="{folder}">{name}</a>' if row.outcome.has_map else name
    sentences = f"<p>{escape(row.reason)}</p>" if row.reason else ""
    sentences += "".join(f'<p class="warning">{escape(sentence)}</p>' for sentence in row.report.cautions)
    if row.outcome.has_map:
        cells = "".join(f'<td class="number">{text}</td>' for text in _numbers(row))
        cells += f'<td class="why">{sentences}</td>'
    else:
        cells = f'<td class="why" colspan="{len(_NUMBERS) + 1}">{sentences}</td>'
    outcome = row.outcome.value
    return (
        f'<tr><td class="picture">{picture}</td>'
        f'<td class="bag">{title}<div class="path">{escape(str(row.job.bag))}</div></td>'
        f'<td><span class="verdict {outcome}">{outcome}</span></td>{cells}</tr>'
    )


def _numbers(row: BatchRow) -> tuple[str, ...]:
    report, residual = row.report, row.report.consistency.scan_matching.mean_residual_m
    return (
        shown(report.result.path_metres, 1),
        shown(report.result.log_seconds, 0),
        shown(report.quality.error_per_10_m, 3),
        shown(report.quality.error_of_whole_m, 3),
        shown(None if residual is None else 1e3 * residual, 1),
        shown(report.counts.loop_closures, 0),
        shown(report.stages.total.wall_seconds, 1),
    )
