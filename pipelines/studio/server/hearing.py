"""The messages accepted from a page: the few that people cause when they use it, and no others.

viser accepts all of its message types, one of which makes the page public, and lets a message set any
property of a control.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

LONGEST_MESSAGE = 1 << 16
"""Bytes; the longest message that a person causes is a path."""
_LONGEST_TEXT = 4096
"""Characters; no path is longer."""
_FARTHEST = 1e6
"""Metres, and the limit of all other numbers: farther than any drive."""
_NEAREST = 1e-3
"""Metres from a camera to its target; at no distance the direction is undefined."""
_STEEPEST = -0.1
"""Maximum z component of a ray's direction, since cameras look straight down."""
_UNIT = 1.0 + 1e-6
"""Maximum length of a direction, within a browser's rounding errors."""
_LARGEST_PICTURE = 100_000
"""Pixels of a page's side; no screen has more."""

Number = Annotated[float, Meta(ge=-_FARTHEST, le=_FARTHEST)]
Place = tuple[Number, Number, Number]
Sideways = Annotated[float, Meta(ge=-_UNIT, le=_UNIT)]
Pixels = Annotated[int, Meta(ge=1, le=_LARGEST_PICTURE)]
Positive = Annotated[float, Meta(gt=0.0, le=_FARTHEST)]
Text = Annotated[str, Meta(max_length=_LONGEST_TEXT)]


class View(Struct, tag="ViewerCameraMessage", tag_field="type"):
    """The camera of a page."""

    wxyz: tuple[Number, Number, Number, Number]
    position: Place
    look_at: Place
    up_direction: Place
    fov: Annotated[float, Meta(gt=0.0, lt=math.pi)]
    near: Positive
    far: Positive
    image_height: Pixels
    image_width: Pixels


class Click(Struct, tag="ScenePointerMessage", tag_field="type"):
    """A click on the floor."""

    event_type: Literal["click"]
    ray_origin: Place
    ray_direction: tuple[Sideways, Sideways, Annotated[float, Meta(ge=-_UNIT, le=_STEEPEST)]]
    screen_pos: tuple[tuple[Number, Number]]
    modifier: Text | None


class Drag(Struct, tag="SceneNodeDragMessage", tag_field="type"):
    """Part of a drag over the floor."""

    phase: Literal["start", "update", "end"]
    name: Text
    instance_index: int | None
    start_position: Place
    start_screen_pos: tuple[Number, Number]
    end_position: Place
    end_screen_pos: tuple[Number, Number]
    button: Literal["left", "middle", "right"]
    modifier: Text | None


class Changed(Struct, forbid_unknown_fields=True):
    """The new value of a control."""

    value: bool | int | float | Text


class Change(Struct, tag="GuiUpdateMessage", tag_field="type"):
    """A control that is set, or a button that is pressed."""

    uuid: Text
    updates: Changed


class Hold(Struct, tag="GuiButtonHoldMessage", tag_field="type"):
    """A button that is held down."""

    uuid: Text
    frequency: Positive


class Command(Struct, tag="CommandTriggerMessage", tag_field="type"):
    """A key with a meaning."""

    uuid: Text


class Pulse(Struct, tag="LocalStorageGetItemResponseMessage", tag_field="type"):
    """The answer that shows that a page has drawn the last frame."""

    value: Text | None
    error: Text | None
    request_uuid: Text


Message = View | Click | Drag | Change | Hold | Command | Pulse


def is_heard(said: bytes | str, control_of: Callable[[str], Any]) -> bool:
    """Whether a person can cause a message; ``control_of`` returns the control or the command of a uuid, or
    None."""
    if isinstance(said, str):
        return False
    try:
        message = msgspec.convert(msgspec.msgpack.decode(said), Message)
    except (ValueError, TypeError, RecursionError):
        return False
    match message:
        case View(position=position, look_at=aim):
            return math.dist(position, aim) > _NEAREST
        case Change(uuid=uuid, updates=changed):
            control = control_of(uuid)
            return _is_usable(control) and _fits(changed.value, control)
        case Hold(uuid=uuid):
            return _is_usable(control_of(uuid))
        case Command(uuid=uuid):
            return hasattr(control_of(uuid), "hotkey")
    return True


def _is_usable(control: Any) -> bool:
    """Whether a control is visible, and can be set."""
    return getattr(control, "visible", False) and not getattr(control, "disabled", True)


def _fits(value: bool | float | str, control: Any) -> bool:
    """Whether a person can set a control to a value."""
    if hasattr(control, "options"):
        return value in control.options
    if isinstance(control.value, bool | str):
        return type(value) is type(control.value)
    if isinstance(value, bool | str) or not hasattr(control, "min"):
        return False
    least = -_FARTHEST if control.min is None else control.min
    most = _FARTHEST if control.max is None else control.max
    return bool(least <= value <= most)
