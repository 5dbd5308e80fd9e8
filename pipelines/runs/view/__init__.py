"""Read and write recordings of runs, and prepare what to show of them."""
