"""The one error that unusable input raises."""

LONGEST = 500  # characters; a message is read on one screen, whatever a file holds


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong, where, and what to do.

    The command line prints the message and exits with 2; a node logs it, reports it on
    /diagnostics and goes on. What comes from a file is escaped, and a long message loses its
    middle: its start says what and where, its end what to do.
    """

    def __init__(self, message: str) -> None:
        text = printable(message)
        if len(text) > LONGEST:
            text = f'{text[:310]} [...] {text[-180:]}'
        super().__init__(text)


def printable(text: str) -> str:
    """Return text in one line that does nothing to a terminal but show itself."""
    if text.isprintable():
        return text
    return ''.join(c if c.isprintable() else c.encode('unicode_escape').decode() for c in text)
