"""The error for everything a user can cause and fix."""


class UserError(Exception):
    """What is wrong, in which file, and what would fix it, in one sentence.

    The command line prints the message and exits with code 2; no traceback is shown.
    """
