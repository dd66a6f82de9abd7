"""Encoding of shared beginnings agrees with encoding each from its first word, in values and gradients."""

import numpy as np
import pytest
import torch
from torch import Tensor

from socialai_dsl.trainer.nets.dialogue import DialogueEncoder, GruEncoder, HeardWords, prefix_tree
from tests.trainer.plain import encode


@pytest.fixture
def encoder() -> DialogueEncoder:
    torch.manual_seed(0)
    return GruEncoder(20, 16).double()


def conversations(count: int, length: int) -> np.ndarray:
    """Histories after each utterance of growing conversations; beyond `length` words the oldest utterances are gone."""
    rng = np.random.default_rng(3)
    rows = []
    for _ in range(count):
        utterances: list[list[int]] = []
        for _ in range(6):
            utterances.append(rng.integers(1, 4, rng.integers(1, 6)).tolist())
            while sum(map(len, utterances)) > length:
                utterances.pop(0)
            words = [word for utterance in utterances for word in utterance]
            rows.append(words + [0] * (length - len(words)))
    return np.array([[0] * length, *rows], np.int16)


def encode_one_by_one(encoder: DialogueEncoder, rows: np.ndarray) -> Tensor:
    return torch.stack([encode(encoder, row) for row in rows])


def encode_tree(encoder: DialogueEncoder, rows: np.ndarray) -> Tensor:
    encoded: Tensor = encoder(prefix_tree(rows))
    return encoded


def test_tree_agrees_with_reencoding_in_values_and_gradients(encoder: DialogueEncoder) -> None:
    rows = conversations(12, 12)
    assert (rows[:, -1] > 0).any(), "some histories must have outgrown the buffer"
    plain, tree = encode_one_by_one(encoder, rows), encode_tree(encoder, rows)
    assert torch.allclose(plain, tree, rtol=0, atol=1e-12)
    weights = torch.randn(plain.shape, dtype=torch.float64)
    parameters = list(encoder.parameters())
    expected = torch.autograd.grad((plain * weights).sum(), parameters)
    got = torch.autograd.grad((tree * weights).sum(), parameters)
    for one, other in zip(expected, got, strict=True):
        assert torch.allclose(one, other, rtol=0, atol=1e-12)


def test_the_empty_history_is_zero(encoder: DialogueEncoder) -> None:
    assert (encode_tree(encoder, np.zeros((3, 8), np.int16)) == 0).all()


def heard_by(rows: np.ndarray, words: int) -> Tensor:
    return torch.tensor([[float(word > 0 and word in row) for word in range(words)] for row in rows]).double()


def test_words_heard_stay_beside_the_recurrent_state() -> None:
    torch.manual_seed(0)
    both = HeardWords(20, 16).double()
    rows = conversations(12, 12)
    got = encode_tree(both, rows)
    assert torch.allclose(got, encode_one_by_one(both, rows), rtol=0, atol=1e-12)
    assert torch.equal(both.split(got)[1], heard_by(rows, 20))
