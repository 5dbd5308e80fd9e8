"""What is raised for a manual constraint that cannot be right."""

from racecar.maps.errors import UserError


class RefusedConstraintError(UserError):
    """A manual constraint is refused; the map stays as it was."""
