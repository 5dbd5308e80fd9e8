"""``racecar evaluate``: the accuracy of trajectories."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.maps.errors import UserError
from racecar.pipelines.commands.options import JsonOption, QuietOption
from racecar.pipelines.commands.outputs import WritesFile
from racecar.pipelines.commands.results import print_warnings, where_figures_are

if TYPE_CHECKING:
    from rich.table import Table

    from racecar.pipelines.runs.evaluation.evaluation import TrajectoryErrors
    from racecar.pipelines.runs.evaluation.relations import RelationErrors
    from racecar.pipelines.runs.trajectory_evaluation import Evaluated


def evaluate(
    trajectories: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRAJ",
            help="Estimated poses: FILE.tum, FILE.csv, or BAG:/topic; several are compared in one table.",
        ),
    ],
    reference: Annotated[
        Path | None,
        typer.Option("--reference", metavar="REF", help="True poses: FILE.tum, FILE.csv, or BAG:/topic."),
    ] = None,
    relations: Annotated[
        Path | None,
        typer.Option(
            "--relations",
            metavar="FILE",
            help="True relative poses of the SLAM benchmark: t1 t2 x y z roll pitch yaw.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE.png",
            help="Draw the error along the path on the map, and over time; with --reference.",
        ),
        WritesFile(".png"),
    ] = None,
    map: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="MAP",
            help="The map of --plot; by default the one beside the trajectory, or named in its report.json.",
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

    from racecar.pipelines.commands.tables import print_tables
    from racecar.pipelines.files.report import write_json
    from racecar.pipelines.runs.trajectory_evaluation import evaluate_all, load_trajectory, plot_errors

    figures: dict[str, Any] = {"command": "racecar evaluate", "compared_with": reference or relations}
    if reference is not None:
        true = load_trajectory(reference)
        evaluated = evaluate_all(trajectories, true)
        each = [{"trajectory": one.path, **one.errors.summary()} for one in evaluated]
        table = _errors_table(evaluated[0].errors) if len(each) == 1 else _comparison_table(evaluated)
        warnings = [*true.warnings, *(sentence for one in evaluated for sentence in one.warnings)]
        figures |= {**(each[0] if len(each) == 1 else {"trajectories": each}), "warnings": warnings}
        if plot is not None:
            plot_errors(evaluated, map, plot)
    else:
        from racecar.pipelines.runs.evaluation.relations import load_relations, relation_errors

        assert relations is not None
        if len(trajectories) > 1 or plot is not None:
            raise UserError("--relations measures one trajectory, and draws nothing; give --reference REF.")
        estimated = load_trajectory(trajectories[0])
        relation = relation_errors(estimated.trajectory, load_relations(relations))
        figures |= {"trajectory": trajectories[0], **relation.summary()}
        table, warnings = _relations_table(relation), estimated.warnings
    if json is not None:
        write_json(json, figures)
    if quiet:
        return
    names = f"{trajectories[0]}" if len(trajectories) == 1 else f"{len(trajectories)} trajectories"
    print_tables(table, title=f"{names} against {reference or relations}")
    print_warnings(warnings)
    if plot is not None:
        print(f"Look at {plot}.")
    if json is not None:
        print(where_figures_are(json))


def _errors_table(errors: "TrajectoryErrors") -> "Table":
    """Absolute and relative errors of a trajectory, one per line."""
    from racecar.pipelines.commands.tables import figure_table

    figures, columns = errors.summary(), ("mean", "median", "rmse", "std", "max")
    rows = {
        "absolute position (m)": figures["absolute_position_m"],
        "absolute heading (°)": figures["absolute_heading_deg"],
        "relative position (m per 1 m)": figures["relative_position_m_per_1m"],
        "relative heading (° per 1 m)": figures["relative_heading_deg_per_1m"],
    }
    return figure_table(
        ("error", *columns),
        ([name, *(f"{row[column]:.4f}" for column in columns if row)] for name, row in rows.items()),
        caption=f"{errors.matched} of {errors.total} poses compared ({errors.matched / errors.total:.1%})",
    )


def _comparison_table(evaluated: "Sequence[Evaluated]") -> "Table":
    """Errors of several trajectories, one line each."""
    from racecar.pipelines.commands.tables import figure_table

    def row(each: "Evaluated") -> list[str]:
        figures = each.errors.summary()
        columns = (
            (figures["absolute_position_m"], "mean"),
            (figures["absolute_position_m"], "max"),
            (figures["absolute_heading_deg"], "mean"),
            (figures["relative_position_m_per_1m"], "mean"),
            (figures["relative_heading_deg_per_1m"], "mean"),
        )
        values = [f"{errors[name]:.4f}" if errors else "–" for errors, name in columns]
        return [str(each.path), *values, f"{figures['matched_share']:.1%}"]

    errors = ("position\n(m)", "largest\n(m)", "heading\n(°)", "per 1 m\n(m)", "per 1 m\n(°)")
    return figure_table(
        ("trajectory", *errors, "compared"),
        (row(each) for each in evaluated),
        caption="Means, and the largest error in position.",
    )


def _relations_table(errors: "RelationErrors") -> "Table":
    """Errors of the relative poses, in the form used by the SLAM benchmark."""
    from racecar.pipelines.commands.tables import figure_table

    figures, rows = errors.summary(), []
    for name, key, square in (("translation (m)", "_m", "_m2"), ("rotation (°)", "_deg", "_deg2")):
        kind = name.split()[0]
        values = (f"{kind}_mean{key}", f"{kind}_std{key}", f"{kind}_mean_square{square}")
        rows.append([name, *(f"{figures[value]:.4f}" for value in values)])
    caption = f"{figures['lost']} of {figures['relations']} relations lost"
    return figure_table(("error", "mean", "std", "mean square"), rows, caption=caption)
