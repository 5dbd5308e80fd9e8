"""The ablation, as tables."""

from collections.abc import Mapping

from rich.table import Table

from benchmarks.ablation.ablation_benchmark import (
    CONFIDENCE,
    EQUAL_WITHIN,
    Effect,
    KindFigures,
)
from benchmarks.markdown_table import add_columns, new_table


def kind_table(kind: str, figures: KindFigures) -> Table:
    """One kind of drive: what each error is with a mechanism and without."""
    table = new_table(
        f"{kind}: mean error with each mechanism and without, over {len(figures.default)} drives",
        f"pays, costs: with {CONFIDENCE:.0%} the difference is not 0; equal: it is below {EQUAL_WITHIN:.0%} "
        "of the error with that; idle: it did nothing; ?: more seeds are needed; an error counts as a metre "
        "at most",
    )
    add_columns(table, "off", "with (m)", "without (m)", "difference (m)", "lost without", "effect")
    for name, found in figures.differences().items():
        lost = [each.share_lost for each in figures.without[name]]
        table.add_row(
            name,
            f"{found.with_m:.4f}",
            f"{found.without_m:.4f}",
            f"{found.mean_m:+.4f} ± {found.standard_error_m:.4f}",
            f"{sum(lost) / len(lost):.1%}",
            found.effect.value,
        )
    return table


def effects_table(kinds: Mapping[str, KindFigures]) -> Table:
    """Where each mechanism pays and where it costs, and on how many kinds of drive it does neither."""
    table = new_table(
        "Where each mechanism pays or costs, and by how much the error is larger without it (m)",
        "docs/measured/localizer.md explains the names",
    )
    for column in ("off", Effect.PAYS.value, Effect.COSTS.value):
        table.add_column(column)
    for column in (Effect.EQUAL, Effect.IDLE, Effect.OPEN):
        table.add_column(column.value, justify="right")
    differences = {kind: figures.differences() for kind, figures in kinds.items()}
    for name in next(iter(differences.values()), {}):
        on: dict[Effect, list[str]] = {effect: [] for effect in Effect}
        for kind, by_name in differences.items():
            found = by_name[name]
            on[found.effect].append(f"{kind} {found.mean_m:+.4f}")
        clear = ("; ".join(on[effect]) for effect in (Effect.PAYS, Effect.COSTS))
        others = (f"{len(on[effect])}" for effect in (Effect.EQUAL, Effect.IDLE, Effect.OPEN))
        table.add_row(name, *clear, *others)
    return table
