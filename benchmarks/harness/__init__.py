"""Shared by all benchmarks: commands, cases and variants, input faults, tables and the JSON file."""
