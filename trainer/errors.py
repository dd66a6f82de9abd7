"""This module names the two ways in which training can be refused or stopped."""


class CheckpointError(ValueError):
    """A checkpoint cannot be used: it is damaged, not one of ours, or made for other actions or images."""


class TrainingStopped(RuntimeError):  # noqa: N818 - it reports an event, as StopIteration does
    """A run ended early with its last good checkpoint intact; the message says why and where that is."""
