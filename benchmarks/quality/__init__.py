"""How often the verdict on a map is right: maps whose error is known, many of them made wrong on purpose."""
