"""The experiments of the lab report: each measures the filter in one way, as a table and figures."""
