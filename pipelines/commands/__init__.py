"""The commands, one a file; heavy imports happen inside them so that ``racecar --help`` is quick."""
