"""What others published on the logs of the SLAM benchmark."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """Mean errors over the relations, metres and degrees, and wall time in seconds."""

    cartographer_translation_m: float
    cartographer_rotation_deg: float
    cartographer_seconds: float
    graph_mapping_translation_m: float
    gmapping_translation_m: float


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
