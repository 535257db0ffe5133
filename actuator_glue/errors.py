"""The one error that unusable input raises."""


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong, where, and what to do.

    The command line prints the message and exits with 2; a node logs it, reports it on
    /diagnostics and goes on.
    """
