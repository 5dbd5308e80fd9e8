"""Maps with a known error, many of them wrong, and how often their verdict is right."""

import random
from dataclasses import asdict
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.harness.bench import Bench
from benchmarks.harness.variant import Variant
from benchmarks.quality.known_drives import KnownDrive, recorded_drives, simulated_drives
from benchmarks.quality.map_errors import map_errors
from benchmarks.quality.spoiled_maps import SPOILINGS, UNSPOILED
from benchmarks.quality.verdict_figures import NEAR, JudgedMap, kind_of, verdict_counts, verdict_shares
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.quality.statistics import LOCAL_DISTANCE
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose
from racecar.pipelines.bags.replay import feed
from racecar.sensors.fixed_returns.fixed_returns import FixedReturns

_SHORTEST = 1.0
"""Metres of path below which there is no meaningful map. Chosen by judgement."""


def quality(
    bench: Bench,
    drives: Annotated[
        int, typer.Option("--drives", min=0, metavar="N", help="Drives through each of five floor plans.")
    ] = 4,
    faults: Annotated[
        int,
        typer.Option(
            "--faults", min=0, max=40, metavar="N", help="Further maps of each drive, each with one fault."
        ),
    ] = 4,
    bags: Annotated[
        Path | None,
        typer.Option(
            "--bags",
            metavar="DIR",
            help="Also map the recordings below this folder that have their true poses, reference.tum, "
            "beside them.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Make maps of known error, many of them wrong, and count how often the verdict on them is right.

    Example: python -m benchmarks quality --drives 1 --json quality.json
    """
    judged = partial(judged_map, base=bench.settings.mapping)
    recorded = iter(()) if bags is None else recorded_drives(bags)
    maps: list[JudgedMap] = []
    for drive in chain(simulated_drives(drives, bench.seed), recorded):
        rows = bench.cross("maps", [(drive.name, drive)], drawn_spoilings(drive, faults), judged)
        maps.extend(rows[drive.name].values())
    if not maps:
        raise UserError("There is nothing to judge: ask for --drives, or name recordings with --bags.")
    counts, shares = verdict_counts(maps), verdict_shares(maps)
    bench.report.add("figures", {"counts": counts, **{name: asdict(share) for name, share in shares.items()}})
    bench.table(
        "Maps by what they are and what the verdict says",
        {
            kind: {f"called {verdict}": str(count) for verdict, count in by_verdict.items()}
            for kind, by_verdict in counts.items()
        },
        "good: at most 0.1 m off per 10 m of path and 0.5 m over all of it, with the settings' defaults; "
        "wrong: three times as much",
    )
    longest = {"measured": f"{max(each.judging_seconds for each in maps):.2f} s", "by chance": ""}
    bench.table(
        "What the verdict is worth",
        {**shares, "longest judgement": longest},
        "by chance: the one error of all maps that fits most; share of all places in wrong maps",
    )


def drawn_spoilings(drive: KnownDrive, count: int) -> dict[str, Variant]:
    """The unchanged drive, and a selection of ways to spoil it that is drawn by the drive's name."""
    others = [name for name in SPOILINGS if name != UNSPOILED]
    drawn = [UNSPOILED, *random.Random(drive.name).sample(others, count)]
    return {name: SPOILINGS[name] for name in drawn}


def judged_map(drive: KnownDrive, spoiling: Variant, base: MappingConfig) -> JudgedMap | None:
    """Map a spoiled drive and compare the verdict with the truth.

    None if there is no map, which is an honest answer, or if too little of the true path is known.
    """
    try:
        result = spoiled_map(drive, spoiling, base)
    except UserError:
        return None
    return compared_with_truth(drive, result, base.quality)


def spoiled_map(drive: KnownDrive, spoiling: Variant, base: MappingConfig) -> MappingResult:
    """Map a spoiled drive. Raises UserError if nothing is left to map."""
    mapper = Mapper(spoiling.configured(base.model_copy(update={"refine": False})))
    with spoiling.in_place():
        for message in FixedReturns().filtered(spoiling.spoiled(drive.messages)):
            feed(message, mapper)
        return mapper.finish()


def compared_with_truth(drive: KnownDrive, result: MappingResult, config: QualityConfig) -> JudgedMap | None:
    """The map compared with the truth; None if too little of the true path is known."""
    stamps = result.trajectory.stamps[result.keyframe_indices]
    known = np.flatnonzero(drive.is_known(stamps))
    if len(known) < 2:
        return None
    # A wrong mount moves the car in the map, but leaves the map itself unchanged.
    true = compose(drive.truth.poses_at(stamps[known]), drive.mount)
    lasers = result.session.map_from_keyframe
    errors = map_errors(lasers[known], true, LOCAL_DISTANCE)
    if errors.path_m < _SHORTEST:
        return None
    first, last = known[list(errors.worst)]
    off = _off_named(result.quality, lasers)
    return JudgedMap(
        kind_of(errors, config),
        result.quality.verdict.value,
        errors,
        result.quality.error_per_10_m,
        result.quality.error_of_whole,
        float(off[first : last + 1].min()) if result.quality.segments else None,
        float(np.mean(off < NEAR)),
        result.seconds["judging"],
        result.quality.statistics,
    )


def _off_named(quality: MapQuality, lasers: Pose) -> NDArray[np.float64]:
    """(K,) metres from each laser pose (K, 3) to the path of the reported segments; infinite if there are
    none."""
    runs = [run for s in quality.segments for run in (s.keyframes, s.contradicted_by) if run is not None]
    if not runs:
        return np.full(len(lasers), np.inf)
    named = np.concatenate([lasers[first : last + 1, :2] for first, last in runs])
    return np.asarray(cKDTree(named).query(lasers[:, :2])[0])
