"""From a map, scans and odometry to the car's pose: Monte Carlo localization."""
