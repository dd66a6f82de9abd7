"""The paper's agents read letters only, behind the sentence their environments begin with."""

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.trainer.features import Actor
from socialai_dsl.trainer.nets import NetSpec, build_net
from socialai_dsl.trainer.nets.reading import LetterReader, Reader

VOCABULARY = ("<pad>", "<unk>", "eve", "it's", "3", "you", "r2d2", "coins")
OPENING = ["this", "is", "what", "you", "hear"]


def spelt(reader: Reader, *tokens: int) -> list[list[str]]:
    """What is read from one history, and from the empty one beside it."""
    rows = np.zeros((2, 8), np.int16)
    rows[0, : len(tokens)] = tokens
    read = reader.read(rows)
    assert read.dtype == np.int16
    assert read.shape == (2, reader.length(8))
    return [[reader.words[word] for word in row if word] for row in read.tolist()]


def test_ids_are_given_in_the_order_of_first_appearance() -> None:
    words = LetterReader(VOCABULARY).words
    assert words == ("", *OPENING, "eve", "it", "s", "r", "d", "coins"), "`you` has its id from the opening"


def test_letters_only_behind_the_opening() -> None:
    reader = LetterReader(VOCABULARY)
    one, empty = spelt(reader, 2, 3, 4, 5, 6, 7)
    assert one == [*OPENING, "eve", "it", "s", "you", "r", "d", "coins"], "digits and apostrophes vanish"
    assert empty == OPENING
    assert spelt(reader, 4, 1, 4)[0] == OPENING, "numbers and the unknown word spell nothing"


def test_words_are_packed_to_the_left_and_padded_with_zeros() -> None:
    reader = LetterReader(VOCABULARY)
    row = reader.read(np.array([[4, 2, 4, 7, 0, 0, 0, 0]], np.int16))[0]
    assert row[:8].tolist() == [1, 2, 3, 4, 5, 6, 11, 0]
    assert (row[8:] == 0).all()


def test_the_longest_history_has_room() -> None:
    one, _ = spelt(LetterReader(VOCABULARY), *[6] * 8)
    assert one == [*OPENING, *["r", "d"] * 8]


def test_without_words_the_opening_is_all() -> None:
    reader = LetterReader(("<pad>", "<unk>"))
    assert reader.read(np.zeros((1, 8), np.int16)).tolist() == [[1, 2, 3, 4, 5]]


def test_there_is_room_for_ninety_nine_words() -> None:
    many = ("<pad>", "<unk>", *(a + b for a in "bcdfgjklmn" for b in "opqrstuvwx"))
    assert len(LetterReader(many[: 2 + 94]).words) == 100
    with pytest.raises(ValueError, match="got 100 words of letters, expected at most 99"):
        LetterReader(many[: 2 + 95])


def test_other_networks_read_the_engine_s_tokens_as_they_are() -> None:
    tokens = np.array([[4, 2, 0]], np.int16)
    reader = Reader(VOCABULARY)
    assert reader.read(tokens) is tokens
    assert reader.length(3) == 3
    assert reader.words == VOCABULARY


def test_what_is_heard_reaches_the_encoder_as_the_paper_s_agents_read_it() -> None:
    """On a real scenario: lines with names, read word by word, and an embedding of a hundred rows whatever it says."""
    envs = sd.make_vec("talkitout", 4, autoreset_mode="SameStep")
    vocabulary = tuple(envs.program.vocabulary)
    net = build_net("paper-reference", NetSpec.of(envs), 0)
    assert net.dialogue.embedding.weight.shape == (100, 128)
    line = [vocabulary.index(word) for word in ("go", "to", "the", "red", "door")]
    tokens = np.zeros((1, envs.single_observation_space["tokens"].shape[0]), np.int16)
    tokens[0, :5] = line
    actor = Actor(net, tokens.shape[1])
    actor.see(np.ones((1, 7, 7, 4), np.uint8), tokens)
    heard = [net.reader.words[word] for word in actor.histories.data[1].tolist() if word]
    assert heard == [*OPENING, "go", "to", "the", "red", "door"]
    envs.close()
