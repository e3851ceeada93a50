"""Errors that a user can mend: one line that names the file, the field, the value, and what would be right."""


class InputError(ValueError):
    """Bad input. The command line prints its text on one line of stderr and exits with status 2."""
