"""Finding the car again: is it lost, where else could it be, and which hypothesis wins."""
