"""The peers' networks in plain PyTorch, which read every frame's image and whole history anew."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.distributions import Categorical

SIZE = 128


class History(nn.Module):
    """Embedding and GRU over the words heard so far; the output at the last word, zero in silence."""

    def __init__(self, vocabulary: int) -> None:
        super().__init__()
        self.embedding = nn.Embedding(vocabulary, SIZE)
        self.gru = nn.GRU(SIZE, SIZE, batch_first=True)

    def forward(self, tokens: Tensor) -> Tensor:
        """0-padded histories, int64 (N, S), to (N, SIZE)."""
        lengths = (tokens > 0).sum(1)
        outputs, _ = self.gru(self.embedding(tokens))
        last = outputs[torch.arange(len(tokens)), (lengths - 1).clamp(min=0)]
        heard: Tensor = last * (lengths > 0)[:, None]
        return heard


def _block(inputs: int, batch_norm: bool) -> nn.Sequential:
    convolution = nn.Conv2d(inputs, SIZE, 3, padding=1)
    return nn.Sequential(convolution, nn.BatchNorm2d(SIZE) if batch_norm else nn.Identity(), nn.ReLU())


class _Film(nn.Module):
    def __init__(self, batch_norm: bool) -> None:
        super().__init__()
        self.first = _block(SIZE, batch_norm)
        self.second = nn.Conv2d(SIZE, SIZE, 3, padding=1)
        self.norm = nn.BatchNorm2d(SIZE) if batch_norm else nn.Identity()
        self.scale, self.shift = nn.Linear(SIZE, SIZE), nn.Linear(SIZE, SIZE)

    def forward(self, images: Tensor, text: Tensor) -> Tensor:
        hidden = self.second(self.first(images))
        hidden = hidden * self.scale(text)[:, :, None, None] + self.shift(text)[:, :, None, None]
        return torch.relu(self.norm(hidden)) + images


class PaperTrunk(nn.Module):
    """The SocialAI 1.0 baselines' perception: two convolutions, two FiLM blocks, max pooling."""

    def __init__(self, vocabulary: int, image_shape: tuple[int, ...], batch_norm: bool = False) -> None:
        super().__init__()
        self.history = History(max(vocabulary, 100))
        self.convolutions = nn.Sequential(_block(image_shape[2], batch_norm), _block(SIZE, batch_norm))
        self.films = nn.ModuleList(_Film(batch_norm) for _ in range(2))

    def forward(self, images: Tensor, tokens: Tensor) -> Tensor:
        """Images, uint8 (N, H, W, C), and histories, int64 (N, S), to features (N, SIZE)."""
        text = self.history(tokens)
        hidden = self.convolutions(images.permute(0, 3, 1, 2).to(text.dtype))
        for film in self.films:
            hidden = film(hidden, text)
        return torch.relu(hidden.amax((2, 3)))


class CellTrunk(nn.Module):
    """The perception of our `fast` network written plainly: cells read in the light of the dialogue, one layer."""

    kind_size = 16

    def __init__(self, vocabulary: int, image_shape: tuple[int, ...]) -> None:
        super().__init__()
        height, ahead, channels = image_shape
        self.history = History(vocabulary)
        self.channels = nn.ModuleList(nn.Embedding(256, self.kind_size) for _ in range(channels))
        self.mentions = nn.Parameter(torch.zeros(vocabulary, channels, 256))
        self.film = nn.Linear(SIZE, 2 * self.kind_size)
        self.cells = nn.Linear(height * ahead * self.kind_size, SIZE)
        self.words = nn.Linear(SIZE, SIZE, bias=False)

    def forward(self, images: Tensor, tokens: Tensor) -> Tensor:
        """Images, uint8 (N, H, W, C), and histories, int64 (N, S), to features (N, SIZE)."""
        text = self.history(tokens)
        cells = images.flatten(1, 2).int()
        kinds = torch.stack([layer(cells[..., i]) for i, layer in enumerate(self.channels)]).sum(0)
        heard = text.new_zeros(len(tokens), len(self.mentions)).scatter_(1, tokens, 1)
        heard[:, 0] = 0  # padding
        codes = torch.einsum("nv,vck->nkc", heard, self.mentions)  # (N, 256, channels)
        mentioned = codes.gather(1, cells.long()).sum(2)  # (N, H * W)
        scale, shift = self.film(text)[:, None].chunk(2, 2)
        read = torch.relu(kinds * (1 + scale + mentioned[:, :, None]) + shift)
        return torch.relu(self.cells(read.flatten(1)) + self.words(text))


class Agent(nn.Module):
    """A trunk, an LSTM cell, a head of two layers for each part of the action, and a critic like them."""

    def __init__(self, trunk: nn.Module, action_sizes: tuple[int, ...]) -> None:
        super().__init__()
        self.trunk = trunk
        self.memory = nn.LSTMCell(SIZE, SIZE)
        self.heads = nn.ModuleList(
            nn.Sequential(nn.Linear(SIZE, 64), nn.Tanh(), nn.Linear(64, n)) for n in (*action_sizes, 1)
        )

    def remember(self, features: Tensor, state: tuple[Tensor, Tensor], kept: Tensor) -> tuple[Tensor, Tensor]:
        """One step of the LSTM; `kept`, float (N, 1), is 0 where an episode begins."""
        h, c = state
        result: tuple[Tensor, Tensor] = self.memory(features, (h * kept, c * kept))
        return result

    def decide(self, hidden: Tensor) -> tuple[list[Any], Tensor]:
        """Distributions of the four parts of the action, and the value (N,)."""
        *logits, value = (head(hidden) for head in self.heads)
        return [Categorical(logits=part) for part in logits], value.squeeze(-1)


def silent(count: int) -> tuple[Tensor, Tensor]:
    """The empty memory of `count` environments."""
    return torch.zeros(count, SIZE), torch.zeros(count, SIZE)
