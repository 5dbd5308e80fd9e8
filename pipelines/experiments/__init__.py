"""The experiments of the lab report; each evaluates the filter in one way, with a table and figures."""
