"""The particle filter: particles drawn, weighed, clustered and resampled."""
