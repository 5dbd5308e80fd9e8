"""``racecar check``: the contents of a bag, and its problems."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.pipelines.commands.options import BagArgument, ConfigOption, ReadingFlags
from racecar.pipelines.commands.results import NOT_GOOD_ENOUGH, EndFlags, where_figures_are

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.table import Table

    from racecar.pipelines.bags.check import BagCheck


def check(
    *,
    bag: BagArgument,
    config: ConfigOption = None,
    reading: ReadingFlags,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit code 3 when a map of the bag would be wrong.")
    ] = False,
    ending: EndFlags,
) -> None:
    """Show what is in a bag, and its problems, before you map it.

    Example: racecar check drive.bag

    In a script: racecar check drive.bag --strict --quiet && racecar map drive.bag --out runs/drive
    """
    from racecar.pipelines.commands.tables import print_tables
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.report import write_json

    with reading.parsed().open(bag, load_config(config).sensors) as reader:
        from racecar.pipelines.runs.calibration_run import check_reader  # after the bag's faults are reported

        result = check_reader(reader, ending.context("racecar check"))
    if ending.json is not None:
        write_json(ending.json, {"command": "racecar check", **result.as_dict()})
    if not ending.quiet:
        cut = "" if result.part.is_whole else f", read from {result.part.words}"
        tables = (_topics_table(result), _facts_table(result), _findings_table(result))
        print_tables(*tables, title=f"{result.path}, {result.size_mb:.1f} MB{cut}")
        if ending.json is not None:
            print(where_figures_are(ending.json))
    if strict and any(finding.spoils_map for finding in result.findings):
        raise typer.Exit(NOT_GOOD_ENOUGH)


def _topics_table(result: "BagCheck") -> "Table":
    from rich.table import Table

    table = Table("topic", "type")
    table.add_column("messages", justify="right")
    for topic in result.topics:
        table.add_row(topic.name, topic.message_type, str(topic.message_count))
    return table


def _facts_table(result: "BagCheck") -> "Table":
    from rich.table import Table

    table = Table("", "", title="Contents", title_justify="left", show_header=False)
    for name, value in _facts_in_words(result):
        table.add_row(name, value)
    return table


def _facts_in_words(result: "BagCheck") -> list[tuple[str, str]]:
    scans, sensor, odometry = result.facts["scans"], result.facts["sensor"], result.facts["odometry"]
    beams = f"{scans['beams_fewest']}"
    if scans["beams_most"] != scans["beams_fewest"]:
        beams += f" to {scans['beams_most']}"
    sweep = f"a sweep takes {scans['sweep_s'] * 1e3:.1f} ms" if scans["sweep_s"] else "no time per beam"
    x, y, yaw = (round(float(each), 3) + 0.0 for each in sensor["place"])  # + 0.0: no "-0"
    hangs = ", upside down" if sensor["upside_down"] else ""
    rows = [
        (
            "scans",
            f"{scans['count']} on {scans['topic']}, {scans['rate_hz']:g} Hz, {scans['duration_s']:.1f} s",
        ),
        ("beams", f"{beams} over {scans['field_of_view_deg']:g}°; {sweep}"),
        ("ranges", f"{_returns(scans)}, misses from {scans['max_range_m']:g} m on"),
        (
            "beams that",
            f"missed: {scans['missed_share']:.1%}, no reading: {scans['no_information_share']:.1%}",
        ),
        ("sensor's place", f"x {x:g} m, y {y:g} m, yaw {yaw:g} rad{hangs} ({sensor['source']})"),
    ]
    if imu := result.facts["imu"]:
        imu_row = f"{imu['count']} on {imu['topic']}, {imu['rate_hz']:g} Hz"
        rows.append(("IMU", f"{imu_row}, turns of up to {imu['fastest_turn_deg_s']:.0f}°/s"))
    if not odometry:
        return [*rows, ("odometry", "none")]
    if not odometry.get("is_used", True):
        return [*rows, ("odometry", f"on {odometry['topic']}, not used: see the findings")]
    return [
        *rows,
        ("odometry", f"{odometry['count']} on {odometry['source']}, {odometry['rate_hz']:g} Hz"),
        (
            "path by odometry",
            f"{odometry['path_length_m']:.1f} m, turned {odometry['turned_deg']:.0f}°, "
            f"up to {odometry['top_speed_m_s']:.1f} m/s",
        ),
        ("scans covered by it", f"{odometry['scans_covered_share']:.1%}"),
    ]


def _findings_table(result: "BagCheck") -> "Table | str":
    from rich.table import Table

    if not result.findings:
        return "No problems found."
    columns = ("grade", "what was found", "what to do about it")
    table = Table(*columns, title="Findings", title_justify="left", show_lines=True)
    for finding in result.findings:
        style = "bold" if finding.spoils_map else None
        table.add_row(finding.grade.value, finding.what, finding.remedy, style=style)
    return table


def _returns(scans: "Mapping[str, Any]") -> str:
    nearest, farthest = scans["nearest_return_m"], scans["farthest_return_m"]
    return "no returns" if nearest is None else f"returns from {nearest:.2f} to {farthest:.2f} m"
