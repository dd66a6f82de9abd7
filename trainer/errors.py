"""The errors that refuse or stop training."""

import torch


class CheckpointError(ValueError):
    """A checkpoint cannot be used: it is damaged, not one of ours, or made for other actions or images."""


class ObservationError(ValueError):
    """An environment returned an image or a token outside the bounds of its observation space."""


class TrainingStopped(RuntimeError):  # noqa: N818 - it reports an event, as StopIteration does
    """A run ended early with its last good checkpoint intact; the message says why and where that is."""


def require_finite(what: str, numbers: torch.Tensor | float) -> None:
    """Raise TrainingStopped unless all numbers are finite."""
    if not bool(torch.isfinite(torch.as_tensor(numbers)).all()):
        raise TrainingStopped(f"{what} is not a finite number")
