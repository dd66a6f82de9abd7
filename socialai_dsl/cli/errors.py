"""The ways a command can end."""

from collections.abc import Iterable
from enum import IntEnum
from pathlib import Path

from socialai_dsl.diagnostics import Diagnostic


class Exit(IntEnum):
    """Exit codes of every command."""

    GOOD = 0
    FINDINGS = 1  # a file has mistakes, or a check failed
    USAGE = 2  # wrong usage, unreadable input, unwritable output
    INTERNAL = 3  # a bug of ours
    STOPPED = 4  # a run stopped by itself: numbers that are not finite, a full disk, a spent budget
    INTERRUPTED = 130  # Ctrl-C, as shells count it
    BROKEN_PIPE = 141  # the reader of our output went away, as shells count it


def is_usage(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether all that is wrong lies in how a scenario was named, or in a file that cannot be read (S007).

    Such findings point into the name itself, which is no file.
    """
    return all(d.code == "S007" or not Path(d.span.file).is_file() for d in diagnostics)
