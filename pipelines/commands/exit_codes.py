"""What the commands' exit codes mean beside 0, 1 for a fault of ours, and 2 for one of the user's."""

NOT_GOOD_ENOUGH = 3
"""With --strict: the command did its work, and what came of it is not to be used."""
INTERRUPTED = 130
"""As of a program that Ctrl-C ended: 128 and the number of the signal."""
