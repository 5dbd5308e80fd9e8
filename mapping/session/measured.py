"""What was measured, as opposed to corrected by hand."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import ConstraintList
from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.arrays import Arrays, named, part_of


@dataclass(frozen=True, eq=False)
class Measured:
    """Poses and constraints without manual ones. All corrections start from here, so that repeating them
    changes nothing."""

    map_from_keyframe: Pose
    """(K, 3)"""
    constraints: ConstraintList
    mended_by: str
    """The manual constraints of the session, as text, to see whether they are those of a file."""

    def moved(self, new_from_map: Pose) -> "Measured":
        """The same in another map frame."""
        return replace(self, map_from_keyframe=compose(new_from_map, self.map_from_keyframe))

    def only(self, chosen: NDArray[np.bool_]) -> "Measured":
        """Those of the selected keyframes (K,)."""
        return replace(
            self,
            map_from_keyframe=self.map_from_keyframe[chosen],
            constraints=self.constraints.among(chosen),
        )

    def to_arrays(self) -> Arrays:
        """By the names documented in `Session`."""
        return {
            "map_from_keyframe": self.map_from_keyframe,
            **named("constraints", self.constraints.to_arrays()),
            "mended_by": np.array([self.mended_by], dtype=np.str_),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "Measured":
        """Rebuild from `to_arrays`."""
        return cls(
            arrays["map_from_keyframe"].astype(np.float64),
            ConstraintList.from_arrays(part_of("constraints", arrays)),
            str(arrays["mended_by"][0]),
        )
