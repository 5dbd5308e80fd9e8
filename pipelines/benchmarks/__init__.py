"""The tables of the README, measured."""
