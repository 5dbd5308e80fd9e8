"""Settings of several levels, as components will have them."""

from typing import Literal

from pydantic import Field

from racecar.maps.settings import Settings


class Lens(Settings):
    focus: float = Field(0.5, gt=0, le=2, description="metres to the focus")
    rings: tuple[int, ...] = Field((1, 2, 4), description="radii of the rings, in cells")


class Camera(Settings):
    """Two levels below the top."""

    exposures: int = Field(3, ge=1, le=9, description="pictures that are added up")
    mode: Literal["day", "night"] = Field("day", description="how bright it is")
    lens: Lens = Lens()


class Robot(Settings):
    """A robot with a camera."""

    speed: float = Field(1.0, ge=0, description="metres per second")
    is_tall: bool = Field(False, description="whether it is tall")
    camera: Camera = Camera()
