"""The errors that simrecon raises on purpose; each message is one line that says what to do."""


class SimreconError(Exception):
    """Base of all errors that simrecon raises on purpose. Exit status 1 unless a child says otherwise."""

    exit_status = 1


class InputError(SimreconError):
    """What the user gave can't be used: the file, the key, what was found, what is valid. Exit status 2."""

    exit_status = 2
