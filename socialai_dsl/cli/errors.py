"""This module names the ways a command can end, and the errors that end it."""

from enum import IntEnum


class Exit(IntEnum):
    """Exit codes of every command."""

    GOOD = 0
    FINDINGS = 1  # a file has mistakes, or a check failed
    USAGE = 2  # wrong usage, unreadable input, unwritable output
    INTERNAL = 3  # a bug of ours
    INTERRUPTED = 130  # Ctrl-C, as shells count it
    BROKEN_PIPE = 141  # the reader of our output went away, as shells count it


class UsageError(Exception):
    """The caller asked for something that cannot be done; the message says what was got and expected."""


class RunFailed(Exception):  # noqa: N818 - it says what happened
    """Training broke down although everything was asked for rightly."""
