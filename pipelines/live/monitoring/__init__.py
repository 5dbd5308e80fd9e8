"""The state of a node: faults, rates and latency, and their diagnostics."""
