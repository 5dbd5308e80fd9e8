"""Loop closure: places that the car has been to before are found, matched and verified."""
