"""The errors that simrecon raises on purpose; each message is one line that says what to do."""

from __future__ import annotations

_LONGEST = 3000


def printable(text: str) -> str:
    """Text for a message, whatever file it is from: one line, not too long, without control characters.

    What can't be printed, such as a newline, an escape sequence of terminals or a byte of a path that is no
    UTF-8, becomes an escape of Python's.
    """
    if not text.isprintable():
        text = "".join(
            letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text
        )
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


class SimreconError(Exception):
    """Base of all errors that simrecon raises on purpose. Exit status 1 unless a child says otherwise."""

    exit_status = 1

    def __init__(self, message: str = "") -> None:
        """Keep the message, made `printable`."""
        super().__init__(printable(message))


class InputError(SimreconError):
    """What the user gave can't be used: the file, the key, what was found, what is valid. Exit status 2."""

    exit_status = 2
