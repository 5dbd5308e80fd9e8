"""Ablation of the localizer: the same drives and seeds with and without each mechanism."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from functools import lru_cache, partial
from typing import Annotated

import numpy as np
import typer

from benchmarks.ablation.ablation_drive import AblationDrive, DriveFigures
from benchmarks.ablation.effects import CONFIDENCE, EQUAL_WITHIN, Difference, Effect, difference
from benchmarks.ablation.mechanisms import variants
from benchmarks.ablation.recorded_drives import recorded_drives
from benchmarks.ablation.simulated_drives import DRIVE_SECONDS, simulated_drives
from benchmarks.harness.bench import Bench
from benchmarks.harness.inputs import DataOption, chosen, recordings_folder
from benchmarks.harness.variant import Variant, replaced
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.recovery import perception

_MAPS_REMEMBERED = 3
"""Maps whose survey is cached, a few bytes per cell, since few variants use another than the default."""
_EVERYTHING = "default"


def ablation(
    bench: Bench,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAME",
            help="Only this mechanism, group or kind of drive; may be repeated. A long run can be made in "
            "parts this way. docs/measured/localizer.md explains the names.",
            show_default=False,
        ),
    ] = None,
    seeds: Annotated[int, typer.Option("--seeds", min=1, metavar="N", help="Drives of each kind.")] = 10,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds",
            min=2.0,
            metavar="SECONDS",
            help="Length of the simulated drives (default: 30), and of the part of a recording that is used "
            "(default: all).",
            show_default=False,
        ),
    ] = None,
    data: DataOption = None,
) -> None:
    """Localize the same drives with everything, with each mechanism of the localizer off, and each group.

    Example: python -m benchmarks ablation --only 'changed map, track' --json changed.json
    """
    recorded = recorded_drives(recordings_folder(data), bench.settings, seconds)
    drives = {**simulated_drives(seconds or DRIVE_SECONDS), **recorded}
    every = variants()
    chosen({**every, **drives}, only, "mechanism or drive")
    named = only or ()
    drives = {kind: each for kind, each in drives.items() if kind in named} or drives
    every = {name: each for name, each in every.items() if name in named} or every
    kinds: dict[str, dict[str, Difference]] = {}
    for kind, drive_of in drives.items():
        by_seed = ((str(seed), (drive_of(seed), seed)) for seed in range(bench.seed, bench.seed + seeds))
        with _surveying_once():
            measure = partial(localized, settings=bench.settings.localization)
            rows = bench.cross(kind, by_seed, {_EVERYTHING: Variant(), **every}, measure)
        kinds[kind] = differences(rows)
        bench.report.add("effects", {kind: {name: asdict(each) for name, each in kinds[kind].items()}})
        bench.table(
            f"{kind}: mean error with each mechanism and without, over {seeds} drives",
            kinds[kind],
            f"pays, costs: with {CONFIDENCE:.0%} the difference is not 0; equal: it is below "
            f"{EQUAL_WITHIN:.0%} of the error with that; idle: it did nothing; ?: more seeds are needed; an "
            "error counts as a metre at most",
        )
    bench.table(
        "Where each mechanism pays or costs, and by how much the error is larger without it (m)",
        {name: _effects({kind: found[name] for kind, found in kinds.items()}) for name in every},
        "docs/measured/localizer.md explains the names",
    )


def localized(
    drive_and_seed: tuple[AblationDrive, int], variant: Variant, settings: LocalizationConfig
) -> DriveFigures:
    """Localize a drive with a new localizer; the seed is also that of its random numbers."""
    drive, seed = drive_and_seed
    with variant.in_place():
        localizer = Localizer(drive.grid, variant.configured(settings), np.random.default_rng(seed))
        return drive.localized(localizer)


def differences(rows: Mapping[str, Mapping[str, DriveFigures]]) -> dict[str, Difference]:
    """Differences by mechanism that is off, from figures by drive with its seed and by mechanism."""
    off = [name for name in next(iter(rows.values())) if name != _EVERYTHING]
    default = [by_variant[_EVERYTHING] for by_variant in rows.values()]
    return {name: difference(default, [by_variant[name] for by_variant in rows.values()]) for name in off}


def _effects(found: Mapping[str, Difference]) -> dict[str, str]:
    """The kinds of drive on which a mechanism helps or hurts, and the number on which it does neither."""
    on: dict[str, list[str]] = {effect.value: [] for effect in Effect}
    for kind, each in found.items():
        on[each.effect].append(f"{kind} {each.difference_m[0]:+.4f}")
    clear = (Effect.PAYS.value, Effect.COSTS.value)
    return {effect: "; ".join(kinds) if effect in clear else str(len(kinds)) for effect, kinds in on.items()}


@contextmanager
def _surveying_once() -> Iterator[None]:
    """Within the block, the data a localizer derives from a map is computed once for all localizers.

    It takes longer than many a drive, and depends only on the map and its settings.
    """
    remember = lru_cache(maxsize=_MAPS_REMEMBERED)
    derived = ("Walls", "find_free_space", "LikelihoodField", "PlaceSearch")
    with replaced((perception, name, remember(getattr(perception, name))) for name in derived):
        yield
