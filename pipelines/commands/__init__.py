"""The commands, one per file. Heavy imports happen inside them so that ``racecar --help`` is quick."""
