"""What ends a request that was understood: the caller's mistake, or a run that stopped by itself."""


class UsageError(ValueError):
    """The caller asked for something that cannot be done; the message says what was got and expected."""


class RunFailed(Exception):  # noqa: N818 - it says what happened
    """A run stopped by itself: its numbers are no longer finite, the disk is full, or a budget is spent."""
