"""What clicks and drags on the floor mean while one watches a node."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.studio.pointed import Pointed


class NodeTool(str, Enum):
    """As the panel names it."""

    MOVE = "Only move the map"
    GOAL = "Send a goal"
    PLACE = "Say where the car is"


HELP = {
    NodeTool.MOVE: "Drag to move, wheel to zoom. Nothing is sent.",
    NodeTool.GOAL: "Click where the car shall go, or drag from there to where it shall look.",
    NodeTool.PLACE: "Drag from where the car is to where it looks. A click leaves the heading open.",
}


@dataclass(frozen=True)
class Senders:
    """Each sends what it is given, and says in a sentence to whom; raises UserError where that is in vain."""

    goal: Callable[[Pose], str]
    """Takes ``map_from_goal`` (3,)."""
    place: Callable[[Pointed], str] | None = None
    """None where nobody need be told."""
