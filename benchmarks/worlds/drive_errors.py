"""The error of a mapped drive over short distances, over long ones, and as a whole."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.harness.table import Column
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.runs.evaluation.relations import missed_relations

_REACH = 10.0
"""Maximum metres between the two poses of a relation, by the definition of the figure."""
_RELATIONS = 4000
_DRIFT_PATH = 100.0
"""Metres of path over which the heading drift is reported."""


@dataclass(frozen=True)
class DriveErrors:
    """Metres and degrees."""

    path_m: Annotated[float, Column("path (m)", ".0f")]
    """True length of the drive."""
    relation_m: Annotated[float, Column("relations (m)", ".3f")]
    """Mean error of a pose relative to one up to 10 m away, on the same or another pass."""
    relation_max_m: Annotated[float, Column("worst relation (m)", ".2f")]
    heading_deg: Annotated[float, Column("heading (°)", ".2f")]
    """Mean heading error of a pose relative to the one 100 m of path before it, or to the first one if the
    drive is shorter."""
    far_m: Annotated[float, Column("farthest (m)", ".2f")]
    """Largest position error relative to the first pose."""


def drive_errors(found: Pose, true: Pose, generator: np.random.Generator) -> DriveErrors:
    """Errors of poses (N, 3), N at least 2, against the true ones (N, 3); relations are drawn."""
    along = lengths_along(true[:, :2])
    first, second = _relations(true, generator)
    relations = np.hypot(*missed_relations(found, true, first, second)[:, :2].T)
    reach = min(_DRIFT_PATH, float(along[-1]))
    begins = np.flatnonzero(along <= along[-1] - reach)
    ends = np.minimum(np.searchsorted(along, along[begins] + reach), len(along) - 1)
    turned = np.abs(missed_relations(found, true, begins, ends)[:, 2])
    from_start = missed_relations(found, true, np.zeros(len(true), dtype=np.int64), np.arange(len(true)))
    return DriveErrors(
        path_m=float(along[-1]),
        relation_m=float(relations.mean()),
        relation_max_m=float(relations.max()),
        heading_deg=float(np.degrees(turned.mean())),
        far_m=float(np.hypot(*from_start[:, :2].T).max()),
    )


def _relations(true: Pose, generator: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (R,) of the two poses of each relation."""
    tree = cKDTree(true[:, :2])
    first = generator.integers(0, len(true), _RELATIONS)
    near = [tree.query_ball_point(place, _REACH) for place in true[first, :2]]
    return first, np.array([others[generator.integers(len(others))] for others in near], dtype=np.int64)
