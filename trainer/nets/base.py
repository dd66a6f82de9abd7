"""The interface of networks, and the parts that all of them share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import torch
from gymnasium import spaces
from torch import Tensor, nn

from socialai_dsl.trainer.nets.dialogue import DialogueEncoder
from socialai_dsl.trainer.nets.memory import LstmMemory, Memory
from socialai_dsl.trainer.nets.reading import Reader
from socialai_dsl.trainer.nets.sight import Sight

Precision = Literal["float32", "bfloat16"]


@dataclass(frozen=True)
class NetSpec:
    """The sizes that a network is built for.

    Attributes:
        action_sizes: choices of the heads: body (the last is no movement), speak (0 is silence), template, slots.
        image_shape: (H, W, C): cells from left to right, cells from far to near, channels.
        image_high: highest value of each channel.
        vocabulary: word of each token id; 0 pads, 1 is the unknown word.
        slots_used: for each template, whether it has each slot; empty if all have all.
    """

    action_sizes: tuple[int, ...]
    image_shape: tuple[int, int, int]
    image_high: tuple[int, ...]
    vocabulary: tuple[str, ...]
    slots_used: tuple[tuple[bool, ...], ...] = ()

    @cached_property
    def used(self) -> Tensor | None:
        """`slots_used` as 0 and 1, float (templates, slots); None if all templates have all slots."""
        return None if all(map(all, self.slots_used)) else torch.tensor(self.slots_used, dtype=torch.float32)

    @property
    def vocabulary_size(self) -> int:
        """Number of token ids."""
        return len(self.vocabulary)

    @classmethod
    def of(cls, envs: Any) -> NetSpec:
        """The sizes of an environment, single or vector.

        Raises:
            ValueError: the spaces are not a `MultiDiscrete` of at least three and a `Dict` of `image` and `tokens`, or
                do not fit the program's words.
        """
        actions = getattr(envs, "single_action_space", envs.action_space)
        if not isinstance(actions, spaces.MultiDiscrete) or len(actions.nvec) < 3 or actions.nvec[1] != 2:
            raise ValueError(
                f"action space: got {actions}, expected MultiDiscrete([bodies, 2, templates, ...])"
            )
        observations = getattr(envs, "single_observation_space", envs.observation_space)
        parts = observations.spaces if isinstance(observations, spaces.Dict) else {}
        image, tokens = parts.get("image"), parts.get("tokens")
        if not (
            isinstance(image, spaces.Box)
            and isinstance(tokens, spaces.Box)
            and (len(image.shape), image.dtype, len(tokens.shape), tokens.dtype)
            == (3, np.dtype(np.uint8), 1, np.dtype(np.int16))
        ):
            raise ValueError(
                f"observation space: got {observations}, expected Dict(image=Box(H, W, C) of uint8, tokens=Box(L) of "
                "int16)"
            )
        high = np.asarray(image.high).reshape(-1, image.shape[2]).max(axis=0)
        words, used = tuple(envs.program.vocabulary), envs.program.sentences.used
        shape = (len(used), *{len(row) for row in used})
        if used and shape != (actions.nvec[2], len(actions.nvec) - 3):
            raise ValueError(
                f"action space: got {actions}, expected (templates, slots) = {shape} as in the program"
            )
        height, width, channels = image.shape
        return cls(tuple(actions.nvec.tolist()), (height, width, channels), tuple(high.tolist()), words, used)


class Heads(nn.Module):
    """Two-layer heads: one for each part of the action, and the value.

    Each is Linear to 64, tanh, Linear (SocialAI 1.0's heads); their first layers are kept as one matrix, because one
    product is faster than several.
    """

    def __init__(self, input_size: int, action_sizes: tuple[int, ...], hidden: int = 64) -> None:
        super().__init__()
        self.hidden_size = hidden
        self.hidden = nn.Linear(input_size, hidden * (len(action_sizes) + 1))
        self.out = nn.ModuleList(nn.Linear(hidden, n) for n in (*action_sizes, 1))

    def forward(self, memory: Tensor) -> tuple[Tensor, Tensor]:
        """Memory (..., M) to logits of all heads side by side (..., sum of sizes) and value (...)."""
        parts = torch.split(torch.tanh(self.hidden(memory)), self.hidden_size, -1)
        outputs = [layer(part) for layer, part in zip(self.out, parts, strict=True)]
        return torch.cat(outputs[:-1], -1), outputs[-1].squeeze(-1)


def unit_row_linear(module: nn.Module) -> None:
    """Draw a `Linear` as the paper's code does: normal weights, each row scaled to length 1; bias 0."""
    if isinstance(module, nn.Linear):
        nn.init.normal_(module.weight)
        with torch.no_grad():
            module.weight /= module.weight.norm(dim=1, keepdim=True)
        nn.init.zeros_(module.bias)


class ActorCritic(nn.Module, ABC):
    """A recurrent policy and value: images and dialogue to features, a memory, heads and a critic.

    A subclass implements `prepare` and `perceive`, and may replace `memory`, `dialogue` or `heads` after this
    constructor; `--net mine:Net` builds `Net(spec)`. The trainer calls the parts one by one, so that each
    distinct image, history and pair of the two is processed once.

    Args:
        features: number of features of a frame.
        memory_size: number of units of the memory.

    Attributes:
        distinct: whether equal frames may share their features; False for networks whose features depend on the
            rest of the batch.
        reducible: whether the network can do the bulk of its arithmetic in bfloat16.
        smallest_share: frames below which a thread of its own waits for Python's lock longer than it helps.
        precision: number type of that bulk; everything else, and all that is stored, is float32.
        word_rows: the parameters with one row for each word; an agent that plays with another vocabulary keeps the rows
            of the words that both have.
        speaker_axes: parameter -> the axis along which it has one slice for each speaker that tokens mark; an agent
            that plays with others keeps the slices of those that both have, and a stranger gets the mean of those of
            speakers who are missing, or, if nobody is, of all.
        reader_class: how histories are read before they are encoded; `reader` is one for the scenario's words.
        sight_class: how images are seen before anything is computed; `sight` is one for the scenario's images.
    """

    distinct = True
    reducible = False
    smallest_share = 1024
    precision: Precision = "float32"
    word_rows: tuple[str, ...] = ("dialogue.embedding.weight",)
    speaker_axes: Mapping[str, int] = MappingProxyType({})
    reader_class: type[Reader] = Reader
    sight_class: type[Sight] = Sight

    def __init__(
        self, spec: NetSpec, features: int, dialogue: DialogueEncoder, memory_size: int = 128
    ) -> None:
        super().__init__()
        self.spec = spec
        self.reader = self.reader_class(spec.vocabulary)
        self.sight = self.sight_class(spec.image_shape, spec.image_high, spec.vocabulary_size)
        self.features = features
        self.dialogue = dialogue
        self.memory: Memory = LstmMemory(features, memory_size)
        self.heads = Heads(memory_size, spec.action_sizes)

    @abstractmethod
    def prepare(self, images: Tensor) -> Any:
        """The part of the work on images, uint8 (I, H, W, C) as `sight` made them, that uses no weights.

        `perceive` gets the result.
        """

    @abstractmethod
    def perceive(self, prepared: Any, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features of pairs of an image and a history.

        Args:
            prepared: result of `prepare` for I images.
            text: (D, dialogue.size) encoded histories.
            image_index: int64 (P,) image of each pair.
            text_index: int64 (P,) history of each pair.

        Returns:
            Features, float32 (P, features).
        """
