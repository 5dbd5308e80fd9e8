"""The particle filter: sampling, weighting, clustering and resampling."""
