"""The ways a command can end."""

from enum import IntEnum


class Exit(IntEnum):
    """Exit codes of every command."""

    GOOD = 0
    FINDINGS = 1  # a file has mistakes, or a check failed
    USAGE = 2  # wrong usage, unreadable input, unwritable output
    INTERNAL = 3  # a bug of ours
    STOPPED = 4  # a run stopped by itself: numbers that are not finite, a full disk, a spent budget
    INTERRUPTED = 130  # Ctrl-C, as shells count it
    BROKEN_PIPE = 141  # the reader of our output went away, as shells count it
