"""This module is the network of the SocialAI 1.0 baselines: convolutions modulated by the dialogue."""

from __future__ import annotations

from collections.abc import Iterable
from typing import cast

import torch
from torch import Tensor, nn
from torch.nn import functional

from trainer.nets import paper_fused as fused
from trainer.nets.base import ActorCritic, NetSpec, unit_row_linear
from trainer.nets.dialogue import DialogueEncoder
from trainer.nets.reading import LetterReader


class _Conv(nn.Conv2d):
    """A 3x3 convolution that computes in the number type of its input; the weights stay as they are kept."""

    bias: nn.Parameter

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__(inputs, outputs, kernel_size=3, padding=1)
        self._filters = fused.Filters()

    def filters(self, height: int, width: int) -> Tensor:
        """The present weights as `trainer.nets.winograd` takes them for images of this size."""
        return self._filters.of(self.weight, height, width)

    def forward(self, images: Tensor) -> Tensor:
        weight, bias = self.weight.to(images.dtype), self.bias.to(images.dtype)
        return functional.conv2d(images, weight, bias, padding=1)


def _rounded_up(rows: Tensor) -> Tensor:
    """Rows and some of zeros, because convolutions of each new number of images are compiled and kept for good."""
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

    def fused(self, images: Tensor, text: Tensor, text_index: Tensor) -> Tensor:
        """`forward` without norms as one step, for bfloat16 images with the channels last."""
        outputs: Tensor = fused.FilmBlock.apply(  # type: ignore[no-untyped-call]
            images,
            self.conv1.weight,
            self.conv1.bias,
            self.conv2.weight,
            self.conv2.bias,
            self.scale(text),
            self.shift(text),
            text_index,
            self.conv1.filters(*images.shape[1:3]),
            self.conv2.filters(*images.shape[1:3]),
        )
        return outputs


class PaperNet(ActorCritic):
    """Two convolutions, two FiLM blocks, max pooling, LSTM 128 and heads; no BatchNorm.

    Source: SocialAI 1.0, appendix on the baselines, with details of the released code: raw integers as input,
    gamma without "1 +", normalisation after the modulation, heads and FiLM layers with rows of length 1.

    With the precision `bfloat16` the images, from the first convolution to the pooling, are of that type: they are
    99 % of the arithmetic. Weights, their gradients, dialogue, LSTM, heads and losses stay float32.

    Attributes:
        batch_norm: whether to normalise over the batch as the released code does.
        may_fuse: whether `fused` is possible, apart from precision and device.
    """

    batch_norm = False
    reducible = True
    shared_from = 64

    def __init__(self, spec: NetSpec, width: int = 128) -> None:
        words = max(len(self.reader_class(spec.vocabulary).words), LetterReader.CAPACITY)
        super().__init__(spec, width, DialogueEncoder(words))
        self.image_conv = nn.Sequential(
            _Conv(spec.image_shape[2], width),
            _norm(width, self.batch_norm),
            nn.ReLU(),
            _Conv(width, width),
            _norm(width, self.batch_norm),
            nn.ReLU(),
        )
        self.blocks = nn.ModuleList(_FilmBlock(width, self.dialogue.size, self.batch_norm) for _ in range(2))
        self.may_fuse = not self.batch_norm and fused.fits(spec.image_shape, width)
        self.apply(unit_row_linear)
        for convolution in self.modules():
            if isinstance(convolution, nn.Conv2d):
                convolution.to(memory_format=torch.channels_last)  # type: ignore[call-overload]

    @property
    def fused(self) -> bool:
        """Whether the images are convolved by `trainer.nets.paper_fused`, as bfloat16 is on CPUs."""
        return (
            self.may_fuse and self.precision == "bfloat16" and self.heads.hidden.weight.device.type == "cpu"
        )

    def prepare(self, images: Tensor) -> Tensor:
        """Images as floats, channels first; the bytes are channels-last in memory as convolutions like them.

        If they are convolved fused, what the first convolution sees at each cell.
        """
        return fused.surroundings(images) if self.fused else images.permute(0, 3, 1, 2).float()

    def perceive(self, prepared: Tensor, text: Tensor, image_index: Tensor, text_index: Tensor) -> Tensor:
        """Features (P, width) of the pairs; see `ActorCritic.perceive`."""
        if self.fused:
            return torch.relu(self._perceive_fused(prepared, text, image_index, text_index))
        number = torch.bfloat16 if self.precision == "bfloat16" else text.dtype
        count = len(image_index)
        if not self.batch_norm:
            prepared, image_index, text_index = map(_rounded_up, (prepared, image_index, text_index))
        hidden = self.image_conv(prepared.to(number)).index_select(0, image_index)
        for block in self.blocks:
            hidden = block(hidden, text, text_index)
        pooled = functional.max_pool2d(hidden, tuple(hidden.shape[2:]))
        return torch.relu(pooled.flatten(1)).to(text.dtype)[:count]

    @torch.compiler.disable  # type: ignore[untyped-decorator]
    def _perceive_fused(
        self, prepared: Tensor, text: Tensor, image_index: Tensor, text_index: Tensor
    ) -> Tensor:
        """Features before the last rectifier, float32, given `fused.surroundings` of the images."""
        first, second = (part for part in self.image_conv if isinstance(part, _Conv))
        seen = fused.FirstConvolution.apply(prepared, first.weight, first.bias)  # type: ignore[no-untyped-call]
        matrices = second.filters(*seen.shape[1:3])
        hidden = fused.Convolution.apply(seen, second.weight, second.bias, matrices)  # type: ignore[no-untyped-call]
        hidden = fused.Chosen.apply(hidden, image_index)  # type: ignore[no-untyped-call]
        for block in cast(Iterable[_FilmBlock], self.blocks):
            hidden = block.fused(hidden, text, text_index)
        peaks: Tensor = fused.Peaks.apply(hidden)  # type: ignore[no-untyped-call]
        return peaks


class PaperReferenceNet(PaperNet):
    """The paper's network with BatchNorm, whose statistics are those of the batch while acting and while learning.

    Frames are never shared, because each one's features depend on the others in its batch. Histories are read as
    letters only, and in evaluation (`eval()`) the running statistics are used.
    """

    batch_norm = True
    distinct = False
    reducible = False
    reader_class = LetterReader
