"""What all benchmarks share: commands, cases and variants, faults of the input, tables and the JSON file."""
