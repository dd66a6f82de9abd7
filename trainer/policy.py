"""Networks as policies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from socialai_dsl.episodes.policies import Observation, Streams
from socialai_dsl.trainer import actions as heads
from socialai_dsl.trainer.features import Actor, Int64
from socialai_dsl.trainer.nets import ActorCritic
from socialai_dsl.trainer.nets.memory import emptied

# Encodings kept before they are made anew, so that endless play does not fill the memory.
_REMEMBERED_FRAMES = 1 << 16


class NetPolicy:
    """A network with its memory, which plays one environment or many.

    It samples its actions, as in the paper, or takes the most probable ones if `greedy`. The network is in evaluation
    mode, so batch normalisation uses the statistics of training, and the actions in one environment do not depend on
    the others (except for the rounding of matrix products).

    Attributes:
        net: the network, a `torch.nn.Module`.
    """

    def __init__(self, net: ActorCritic, greedy: bool = False, seed: int = 0) -> None:
        self.net = net.eval()
        self._greedy = greedy
        self._streams = Streams(seed)
        self._actor: Actor | None = None
        self._memory = net.memory.initial(1)
        self._seen = np.zeros((1, net.sight.size), np.int64)
        self._last: tuple[torch.Tensor, torch.Tensor] | None = None

    def reset(self, mask: NDArray[np.bool_] | None = None, episodes: Int64 | None = None) -> None:
        """Forget the past where a new episode begins, `mask` bool (E,), or everywhere; see `Policy.reset`."""
        if mask is None:
            mask = np.ones(len(self._memory), np.bool_)
        self._require(len(mask))
        self._memory = emptied(self._memory, torch.from_numpy(mask).to(self._memory.device))
        self._seen[mask] = 0
        self._streams.begin(mask, episodes)

    def enter(self, mask: NDArray[np.bool_]) -> None:
        """Forget the map of a room, but not what is remembered, as in training; see `Entering.enter`."""
        self._require(len(mask))
        self._seen[mask] = 0

    @torch.no_grad()
    def act(self, observation: Observation) -> Int64:
        """Choose actions, int64 (E, heads), as `Policy.act` does; of a single observation one, int64 (heads,)."""
        alone = observation["tokens"].ndim == 1
        logits, _ = self._look(observation, alone)
        if not self._greedy:
            noise = torch.from_numpy(self._streams.gumbel(*logits.shape))
            logits = logits + noise.to(logits.device)
        chosen: Int64 = heads.choose(logits, self.net.spec.action_sizes).cpu().numpy()
        return chosen[0] if alone else chosen

    def state(self) -> dict[str, NDArray[Any]]:
        """Memory, what its sight keeps, and the places of its random numbers, as arrays by name."""
        memory: NDArray[Any] = self._memory.cpu().numpy().copy()
        return {"memory": memory, "seen": self._seen.copy(), "streams": self._streams.state()}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on where `state` was taken, to the bit.

        Raises:
            KeyError, ValueError: it is of another network.
        """
        if state["memory"].shape[1:] != tuple(self._memory.shape[1:]):
            raise ValueError(
                f"memory: got {state['memory'].shape}, expected (E, {tuple(self._memory.shape[1:])})"
            )
        self._memory = torch.from_numpy(state["memory"].copy()).to(self._memory)
        self._seen = state["seen"].copy()
        self._streams.load_state(state["streams"])
        self._actor = None

    def thought(self) -> tuple[list[list[float]], float]:
        """What the agent made of the first room's last observation.

        Returns:
            For each head the probability of each of its choices, and the expected return.

        Raises:
            ValueError: `act` was not called yet.
        """
        if self._last is None:
            raise ValueError("thought: got a call before `act`; expected one after it")
        logits, values = self._last
        parts = torch.split(logits[0], list(self.net.spec.action_sizes))
        return [torch.softmax(part, -1).tolist() for part in parts], float(values[0])

    def _look(self, observation: Observation, alone: bool) -> tuple[torch.Tensor, torch.Tensor]:
        """Logits of all heads side by side (E, A), and values (E,); the memory goes on."""
        images, tokens = observation["image"], observation["tokens"]
        if alone:
            images, tokens = images[None], tokens[None]
        self._require(len(tokens))
        if self._actor is None or len(self._actor.pairs.data) > _REMEMBERED_FRAMES:
            self._actor = Actor(self.net, tokens.shape[1])
        images, self._seen = self.net.sight.look(images, tokens, self._seen)
        _, features = self._actor.see(images, tokens)
        output, self._memory = self.net.memory.step(features, self._memory)
        self._last = self.net.heads(output)
        return self._last

    def _require(self, count: int) -> None:
        """Begin with an empty memory if another number of environments is played now."""
        if len(self._memory) != count:
            self._memory, self._actor = self.net.memory.initial(count), None
            self._seen = np.zeros((count, self.net.sight.size), np.int64)
