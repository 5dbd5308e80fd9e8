"""The tables of the documentation, measured."""
