"""Is the car where the poses of a drive say, and is this the map of the place? Judged over a whole drive."""
