"""The accuracy of map verdicts: maps with a known error, many of them made wrong on purpose."""
