"""What others published on the logs of the SLAM benchmark."""

from dataclasses import dataclass
from typing import Annotated

from benchmarks.harness.table import Column


@dataclass(frozen=True)
class Published:
    """Mean errors over the relations, and wall time."""

    cartographer_translation_m: Annotated[float | None, Column("Cartographer (m)", ".4f")] = None
    cartographer_rotation_deg: Annotated[float | None, Column("Cartographer (°)", ".3f")] = None
    cartographer_seconds: Annotated[float | None, Column("Cartographer (s)", ".0f")] = None
    graph_mapping_translation_m: Annotated[float | None, Column("graph mapping (m)", ".3f")] = None
    gmapping_translation_m: Annotated[float | None, Column("GMapping (m)", ".3f")] = None


SOURCES = (
    "Cartographer: Hess et al., ICRA 2016, wall time on a six-core Xeon. "
    "Graph mapping and GMapping: Kümmerle et al., Autonomous Robots 27, 2009."
)

PUBLISHED = {
    "aces": Published(0.0375, 0.373, 41.0, 0.044, 0.060),
    "intel": Published(0.0229, 0.453, 179.0, 0.031, 0.070),
    "fr079": Published(0.0452, 0.538, 62.0, 0.056, 0.061),
}
"""By name of the log."""
UNPUBLISHED = Published()
