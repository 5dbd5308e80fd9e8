"""The map as the filter uses it: free space and distances to walls."""
