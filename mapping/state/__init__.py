"""The state of a mapper: the map under construction, its trimming and its result."""
