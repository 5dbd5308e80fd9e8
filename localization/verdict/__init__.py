"""The verdict on a whole drive: whether its poses are right, and whether this is the map of the place."""
