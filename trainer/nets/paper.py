"""The network of the SocialAI 1.0 baselines: convolutions modulated by the dialogue."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from socialai_dsl.trainer.nets.base import ActorCritic, NetSpec, unit_row_linear
from socialai_dsl.trainer.nets.dialogue import GruEncoder
from socialai_dsl.trainer.nets.reading import LetterReader


class _Conv(nn.Conv2d):
    """A 3x3 convolution that computes in the number type of its input; the weights stay as they are kept."""

    bias: nn.Parameter

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__(inputs, outputs, kernel_size=3, padding=1)

    def forward(self, images: Tensor) -> Tensor:
        weight, bias = self.weight.to(images.dtype), self.bias.to(images.dtype)
        return functional.conv2d(images, weight, bias, padding=1)


def _rounded_up(rows: Tensor) -> Tensor:
    """The rows and some of zeros: PyTorch compiles and keeps convolutions for each number of images it meets."""
    grain = 8 if len(rows) <= 64 else 64
    return functional.pad(rows, (0, 0) * (rows.dim() - 1) + (0, -len(rows) % grain))


def _norm(width: int, batch_norm: bool) -> nn.Module:
    return nn.BatchNorm2d(width) if batch_norm else nn.Identity()


class _FilmBlock(nn.Module):
    """Two convolutions, modulation per channel by the dialogue, and a residual connection."""

    def __init__(self, width: int, text_size: int, batch_norm: bool) -> None:
        super().__init__()
        self.conv1, self.norm1 = _Conv(width, width), _norm(width, batch_norm)
        self.conv2, self.norm2 = _Conv(width, width), _norm(width, batch_norm)
        self.scale = nn.Linear(text_size, width)
        self.shift = nn.Linear(text_size, width)

    def forward(self, images: Tensor, text: Tensor, text_index: Tensor) -> Tensor:
        hidden = self.conv2(torch.relu(self.norm1(self.conv1(images))))
        scale = self.scale(text).to(images.dtype).index_select(0, text_index)[:, :, None, None]
        shift = self.shift(text).to(images.dtype).index_select(0, text_index)[:, :, None, None]
        return torch.relu(self.norm2(torch.addcmul(shift, hidden, scale))) + images


class PaperNet(ActorCritic):
    """Two convolutions, two FiLM blocks, max pooling, LSTM 128 and heads; no BatchNorm.

    Source: SocialAI 1.0, appendix on the baselines, with details of the released code: raw integers as input,
    gamma without "1 +", normalisation after the modulation, heads and FiLM layers with rows of length 1.

    With the precision `bfloat16` the images, from the first convolution to the pooling, are of that type: they are
    99 % of the arithmetic. Weights, their gradients, dialogue, LSTM, heads and losses stay float32.

    Attributes:
        batch_norm: whether to normalise over the batch as the released code does.
    """

    batch_norm = False
    reducible = True
    smallest_share = 128  # convolutions are 99 % of the arithmetic, and hold no lock

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        words = max(len(self.reader_class(spec.vocabulary).words), LetterReader.CAPACITY)
        super().__init__(spec, width, GruEncoder(words))
        self.image_conv = nn.Sequential(
            _Conv(spec.image_shape[2], width),
            _norm(width, self.batch_norm),
            nn.ReLU(),
            _Conv(width, width),
            _norm(width, self.batch_norm),
            nn.ReLU(),
        )
        self.blocks = nn.ModuleList(_FilmBlock(width, self.dialogue.size, self.batch_norm) for _ in range(2))
        self.apply(unit_row_linear)
        self.to(memory_format=torch.channels_last)  # type: ignore[call-overload]

    def prepare(self, images: Tensor) -> Tensor:
        """Images (I, C, H, W) as floats; the bytes lie channels-last in memory, as convolutions like them."""
        return images.permute(0, 3, 1, 2).float()

    def perceive(self, prepared: Tensor, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        number = torch.bfloat16 if self.precision == "bfloat16" else text.dtype
        count = len(image_index)
        if not self.batch_norm:
            prepared, image_index, text_index = map(_rounded_up, (prepared, image_index, text_index))
        hidden = self.image_conv(prepared.to(number)).index_select(0, image_index)  # (P, width, H, W)
        for block in self.blocks:
            hidden = block(hidden, text, text_index)
        pooled = functional.max_pool2d(hidden, tuple(hidden.shape[2:]))
        return torch.relu(pooled.flatten(1)).to(text.dtype)[:count]


class PaperReferenceNet(PaperNet):
    """The paper's network with BatchNorm, whose statistics are those of the batch while acting and while learning.

    Frames are never shared, because each one's features depend on the others in its batch. Histories are read as
    letters only, and in evaluation (`eval()`) the running statistics are used.
    """

    batch_norm = True
    distinct = False
    reducible = False
    reader_class = LetterReader
