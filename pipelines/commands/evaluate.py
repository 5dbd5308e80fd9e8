"""``racecar evaluate``: how good trajectories are."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from racecar.maps.errors import UserError
from racecar.pipelines.commands.options import PAGE_WIDTH, JsonOption, QuietOption
from racecar.pipelines.commands.outputs import WritesFile


def evaluate(
    trajectories: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRAJ",
            help="Estimated poses: FILE.tum, FILE.csv, or BAG:/topic; several are compared in one table.",
            show_default=False,
        ),
    ],
    reference: Annotated[
        Path | None,
        typer.Option(
            "--reference",
            metavar="REF",
            help="True poses: FILE.tum, FILE.csv, or BAG:/topic.",
            show_default=False,
        ),
    ] = None,
    relations: Annotated[
        Path | None,
        typer.Option(
            "--relations",
            metavar="FILE",
            help="True relative poses of the SLAM benchmark: t1 t2 x y z roll pitch yaw.",
            show_default=False,
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE.png",
            help="Draw the error along the path on the map, and over time; with --reference.",
            show_default=False,
        ),
        WritesFile(".png"),
    ] = None,
    map: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="MAP",
            help="The map of --plot; by default the one beside the trajectory, or named in its report.json.",
            show_default=False,
        ),
    ] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Measure trajectories against true poses (absolute and relative error, by evo) or true relations.

    Example: racecar evaluate runs/drive/trajectory.tum --reference drive.ground_truth.tum --plot errors.png

    Several: racecar evaluate runs/a/trajectory.tum runs/b/trajectory.tum --reference drive.ground_truth.tum

    A topic of a bag: racecar evaluate drive.bag:/pf/pose/odom --reference motion_capture.csv
    """
    if (reference is None) == (relations is None):
        raise UserError("Name what to compare with: either --reference REF or --relations FILE.")
    if map is not None and plot is None:
        raise UserError("--map is drawn by --plot FILE.png; give both, or neither.")

    from rich.console import Console

    from racecar.pipelines.commands.printed_warnings import print_warnings
    from racecar.pipelines.commands.tables import (
        print_title,
        relations_table,
        trajectories_table,
        trajectory_table,
    )
    from racecar.pipelines.commands.written_files import where_figures_are
    from racecar.pipelines.files.report import write_json
    from racecar.pipelines.runs.trajectory_evaluation import evaluate_all, plot_errors
    from racecar.pipelines.runs.trajectory_files import load_trajectory

    figures: dict[str, Any] = {"command": "racecar evaluate", "compared_with": reference or relations}
    if reference is not None:
        true = load_trajectory(reference)
        evaluated = evaluate_all(trajectories, true)
        each = [{"trajectory": one.path, **one.errors.summary()} for one in evaluated]
        table = trajectory_table(evaluated[0].errors) if len(each) == 1 else trajectories_table(evaluated)
        warnings = [*true.warnings, *(sentence for one in evaluated for sentence in one.warnings)]
        figures |= {**(each[0] if len(each) == 1 else {"trajectories": each}), "warnings": warnings}
        if plot is not None:
            plot_errors(evaluated, map, plot)
    else:
        from racecar.pipelines.evaluation.relations import load_relations, relation_errors

        assert relations is not None
        if len(trajectories) > 1 or plot is not None:
            raise UserError("--relations measures one trajectory, and draws nothing; give --reference REF.")
        estimated = load_trajectory(trajectories[0])
        relation = relation_errors(estimated.trajectory, load_relations(relations))
        figures |= {"trajectory": trajectories[0], **relation.summary()}
        table, warnings = relations_table(relation), estimated.warnings
    if json is not None:
        write_json(json, figures)
    if quiet:
        return
    console = Console(width=None if sys.stdout.isatty() else PAGE_WIDTH)
    names = f"{trajectories[0]}" if len(trajectories) == 1 else f"{len(trajectories)} trajectories"
    print_title(console, f"{names} against {reference or relations}")
    console.print(table)
    print_warnings(warnings)
    if plot is not None:
        console.print(f"Look at {plot}.", markup=False, highlight=False, soft_wrap=True)
    if json is not None:
        console.print(where_figures_are(json), markup=False, highlight=False, soft_wrap=True)
