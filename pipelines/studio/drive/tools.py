"""What clicks and drags on the floor mean while one drives."""

from enum import Enum


class Tool(str, Enum):
    """As the panel names it."""

    DRIVE = "Drive there"
    ESTIMATE = "Say where the car is"
    CARRY = "Carry the car"


TOOLS = {
    Tool.DRIVE: "Click a place, and the car drives there.",
    Tool.ESTIMATE: "Drag from where the car is to where it looks: the localizer starts there. "
    "A click leaves the heading open.",
    Tool.CARRY: "Drag from where the car shall stand to where it shall look. The localizer is not told.",
}
