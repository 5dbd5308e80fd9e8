"""What all benchmarks have in common: commands, cases and variants, tables, the JSON file, replaced parts."""
