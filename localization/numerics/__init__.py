"""Fast random numbers, trigonometry and prefetching for the loops over particles."""
