"""Algorithms: how a run plays, how it learns from that, and how what it has learnt is played."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray
from torch import Tensor

from socialai_dsl.episodes.policies import Policy
from socialai_dsl.trainer.nets import ActorCritic


class Algorithm(Protocol):
    """The interface of an algorithm; `--algorithm mine:Algorithm` builds `Algorithm(session)`.

    The session has what every algorithm needs: the environments, the network with its optimizer, the generator of all
    randomness, bonus, curriculum, guide, auxiliary loss and the options of the moment, `session.now`. It is saved with
    them, so an algorithm's own state is only what it adds. Built means started: there is no other beginning.
    """

    def collect(self) -> Any:
        """Play `horizon` steps in every environment, as `socialai_dsl.trainer.rollout.collect` does.

        Returns:
            What `update` is given; its attribute `tally`, a `socialai_dsl.trainer.logging.Tally`, counts the episodes.
        """

    def update(self, played: Any) -> Mapping[str, float | None]:
        """Learn from what was played.

        Returns:
            The figures of the update by name, in a row of `metrics.jsonl`; None where there is nothing to tell.
        """

    def state(self) -> Mapping[str, NDArray[Any] | Tensor]:
        """What it remembers besides the session, as arrays or tensors by name."""

    def load_state(self, state: Mapping[str, Tensor]) -> None:
        """Continue from what `state()` of an equal algorithm returned, which is on the CPU."""

    @staticmethod
    def policy(net: ActorCritic, greedy: bool, seed: int) -> Policy:
        """What plays with a network that was trained.

        Args:
            net: the network.
            greedy: whether to choose the best actions rather than to draw.
            seed: of the draws.
        """
        raise NotImplementedError
