"""What all benchmarks have in common: commands, cases and variants, faults of the input, tables, the JSON file."""
