"""The map as the filter uses it: where the car can be, and how far the walls are."""
