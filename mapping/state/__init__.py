"""What a mapper knows: the map under construction, how it is saved, what is trimmed of it, what it yields."""
