"""What is raised for a manual constraint that cannot be right."""

from racecar.mapping.mending.manual_constraints import Moment
from racecar.maps.errors import UserError


class RefusedConstraintError(UserError):
    """A manual constraint is refused; the map stays as it was."""

    def __init__(self, sentence: str, instead: tuple[Moment, Moment] | None = None) -> None:
        """``instead`` are moments that may be meant."""
        super().__init__(sentence)
        self.instead = instead
