"""The place of a laser on the car; nodes remember it, since ``/tf_static`` may take seconds to arrive."""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, ConfigDict, PlainSerializer
from pydantic.dataclasses import dataclass

_FARTHEST = 1e7
"""Metres or radians: a quarter of the earth's circumference."""


def _array_of(*shape: int) -> Callable[[Any], NDArray[np.float64]]:
    def read(value: Any) -> NDArray[np.float64]:
        try:
            array = np.array(value, dtype=np.float64)
        except TypeError as error:
            raise ValueError("these are no numbers") from error
        if array.shape != shape or not (np.abs(array) <= _FARTHEST).all():
            raise ValueError(f"these are not {shape} numbers of a car's surroundings")
        return array

    return read


_AS_LISTS = PlainSerializer(lambda array: array.tolist())
Vector = Annotated[NDArray[np.float64], BeforeValidator(_array_of(3)), _AS_LISTS]
Square = Annotated[NDArray[np.float64], BeforeValidator(_array_of(3, 3)), _AS_LISTS]
Transform = Annotated[NDArray[np.float64], BeforeValidator(_array_of(4, 4)), _AS_LISTS]
"""(3,), (3, 3) and (4, 4), as files hold them."""


@dataclass(frozen=True, eq=False, config=ConfigDict(arbitrary_types_allowed=True))
class LaserPlace:
    """A laser's place, with the names of the frames."""

    base_frame: str
    laser_frame: str
    base_from_laser: Transform
