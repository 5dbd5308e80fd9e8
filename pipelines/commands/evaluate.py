"""``racecar evaluate``: how good a trajectory is."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.maps.errors import UserError
from racecar.pipelines.commands.options import JsonOption, QuietOption


def evaluate(
    trajectory: Annotated[
        Path, typer.Argument(metavar="TRAJ", help="Estimated poses, a TUM file.", show_default=False)
    ],
    reference: Annotated[
        Path | None,
        typer.Option("--reference", metavar="REF.tum", help="True poses, a TUM file.", show_default=False),
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
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Measure a trajectory against true poses (absolute and relative error) or true relations.

    Example: racecar evaluate runs/drive/trajectory.tum --reference drive.ground_truth.tum
    """
    if (reference is None) == (relations is None):
        raise UserError("Name what to compare with: either --reference REF.tum or --relations FILE.")

    from rich.console import Console

    from racecar.pipelines.commands.tables import print_title, relations_table, trajectory_table
    from racecar.pipelines.evaluation.evaluation import compare
    from racecar.pipelines.evaluation.relations import load_relations, relation_errors
    from racecar.pipelines.files.report import write_json
    from racecar.pipelines.files.tum import load_tum

    estimated = load_tum(trajectory)
    if reference is not None:
        errors = compare(estimated, load_tum(reference))
        figures, table = errors.summary(), trajectory_table(errors)
    else:
        assert relations is not None
        relation = relation_errors(estimated, load_relations(relations))
        figures, table = relation.summary(), relations_table(relation)
    if json is not None:
        write_json(json, {"trajectory": trajectory, "compared_with": reference or relations, **figures})
    if not quiet:
        console = Console()
        print_title(console, f"{trajectory} against {reference or relations}")
        console.print(table)
