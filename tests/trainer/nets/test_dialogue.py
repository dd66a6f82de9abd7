"""Streamed encoding of histories agrees with encoding each from its first word, in values and gradients."""

import numpy as np
import pytest
import torch
from torch import Tensor

from tests.trainer.plain import encode
from trainer.nets.dialogue import DialogueEncoder, HeardWords, prefix_tree


@pytest.fixture
def encoder() -> DialogueEncoder:
    torch.manual_seed(0)
    return DialogueEncoder(20, 16).double()


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
    tree = prefix_tree(rows)
    states: Tensor = encoder(tree)
    return states[tree.leaves]


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


def test_extending_agrees_with_reencoding(encoder: DialogueEncoder) -> None:
    rows = conversations(5, 40)[1:]
    full = encode_one_by_one(encoder, rows)
    lengths = (rows > 0).sum(1)
    known = np.maximum(lengths - np.array([5, 4, 3, 2, 1, 0] * 5), 0)
    starts = np.where(np.arange(40) < known[:, None], rows, 0)
    suffix = np.array([[*row[begun:], *[0] * begun][:6] for row, begun in zip(rows, known, strict=True)])
    states = encode_one_by_one(encoder, starts).detach()
    extended = encoder.extend(states, torch.tensor(suffix.astype(np.int64)), encoder.word_inputs())
    assert torch.allclose(extended, full, rtol=0, atol=1e-12)


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


def test_extending_adds_the_words_heard_since() -> None:
    both = HeardWords(20, 16).double()
    rows = np.array([[3, 1, 2, 4], [5, 5, 6, 0], [7, 0, 0, 0]], np.int16)
    known = np.array([[3, 0, 0, 0], [5, 0, 0, 0], [7, 0, 0, 0]], np.int16)
    before = encode_tree(both, known).detach()
    suffix = torch.tensor([[1, 2, 4], [5, 6, 0], [0, 0, 0]])
    after = both.extend(before, suffix, both.word_inputs())
    assert torch.allclose(after, encode_tree(both, rows), rtol=0, atol=1e-12)
    assert torch.equal(both.split(before)[1], heard_by(known, 20)), "what was known stays as it is"
