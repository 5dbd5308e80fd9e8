"""The figures of the nodes while a bag was played, as a table."""

from collections.abc import Callable, Sequence

from rich.table import Table

from benchmarks.live.node_benchmark import LiveFigures


def live_table(figures: Sequence[LiveFigures], speed: float) -> Table:
    """The figures of each node on each drive, a column each."""
    table = Table(title=f"Live, at {speed:g} times real speed", title_justify="left")
    table.add_column("")
    ordered = sorted(figures, key=lambda each: each.node)
    for each in ordered:
        table.add_column(f"{each.node}\n{each.drive}", justify="right")
    rows: dict[str, Callable[[LiveFigures], str]] = {
        "scans in the bag": lambda f: f"{f.scans}",
        "scans received": lambda f: f"{f.received}",
        "scans with a pose": lambda f: f"{f.posed}",
        "odometry in the bag": lambda f: f"{f.odometry}",
        "poses at odometry's rate": lambda f: f"{f.pose_messages}" if f.node == "localizer" else "",
        "latency, median (ms)": lambda f: _number(f.latency_ms.get("median"), 2),
        "latency, 99 % (ms)": lambda f: _number(f.latency_ms.get("percentile_99"), 2),
        "medians by tenth of the drive (ms)": lambda f: " ".join(f"{ms:.1f}" for ms in f.latency_ms_by_tenth),
        "seen from outside, median (ms)": lambda f: _number(f.seen_latency_ms.get("median"), 2),
        "seen from outside, 99 % (ms)": lambda f: _number(f.seen_latency_ms.get("percentile_99"), 2),
        "memory by tenth of the drive (MB)": lambda f: " ".join(f"{mb:.0f}" for mb in f.memory_mb_by_tenth),
        "memory at most (MB)": lambda f: _number(f.peak_memory_mb, 0),
        "share of a core": lambda f: f"{f.cpu_share:.1%}",
        "of a core, taken by other machines": lambda f: f"{f.stolen_share:.1%}",
        "error, live (m)": lambda f: _number(f.error_live_m, 4),
        "error, offline (m)": lambda f: _number(f.error_offline_m, 4),
        "end points on walls, live": lambda f: _number(f.on_walls_live, 3),
        "end points on walls, offline": lambda f: _number(f.on_walls_offline, 3),
        "longest backlog (s)": lambda f: _number(f.longest_backlog_s, 3),
        "from the offline map's path (m)": lambda f: _number(f.from_offline_map_m, 4),
    }
    for name, show in rows.items():
        table.add_row(name, *(show(each) for each in ordered))
    return table


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
