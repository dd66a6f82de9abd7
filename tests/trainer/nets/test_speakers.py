"""Where lines are marked, the networks `relations` and `speakers` know who said what, and what follows from it."""

import numpy as np
import pytest
import torch
from torch import Tensor

from socialai_dsl.trainer.nets import NetSpec, SpeakersNet
from socialai_dsl.trainer.nets.dialogue import prefix_tree
from socialai_dsl.trainer.nets.lines import HeardSpeakers

WORDS = ("<pad>", "<unk>", "<Ann>", "<Old Bob>", "ann", "bob", "yes", "no", "hello", "red", "blue", "door")


@pytest.fixture
def encoder() -> HeardSpeakers:
    torch.manual_seed(0)
    return HeardSpeakers(WORDS, 16)


def heard(
    encoder: HeardSpeakers, lines: list[list[str]]
) -> tuple[list[set[str]], list[set[str]], list[float]]:
    """Of one history the words of each speaker, those of its last line, and who was named."""
    row = [WORDS.index(word) for line in lines for word in line]
    _, said, last, named = encoder.parts(encoder(prefix_tree(np.array([row + [0] * (20 - len(row))]))))

    def words(part: Tensor) -> list[set[str]]:
        return [{WORDS[at] for at in np.flatnonzero(row)} for row in part[0].detach().numpy()]

    return words(said), words(last), named[0].tolist()


def test_words_are_known_by_speaker_and_who_was_named_by_another(encoder: HeardSpeakers) -> None:
    lines = [["<Ann>", "hello"], ["<Old Bob>", "ann", "no"], ["<Old Bob>", "bob", "red"], ["<Ann>", "yes"]]
    assert heard(encoder, []) == ([set(), set()], [set(), set()], [0, 0])
    assert heard(encoder, lines[:1]) == ([{"hello"}, set()], [{"hello"}, set()], [0, 0])
    assert heard(encoder, lines[:3]) == (
        [{"hello"}, {"ann", "no", "bob", "red"}],
        [{"hello"}, {"bob", "red"}],
        [1, 0],
    ), "nobody is named by his own lines"
    assert heard(encoder, lines)[1] == [{"yes"}, {"bob", "red"}]


def test_words_before_the_first_mark_are_nobody_s(encoder: HeardSpeakers) -> None:
    """The oldest lines make room in the middle of one."""
    assert heard(encoder, [["red", "ann"], ["<Ann>", "bob"]]) == ([{"bob"}, set()], [{"bob"}, set()], [0, 1])


def test_a_scenario_whose_lines_are_not_marked_is_refused() -> None:
    words = tuple(word for word in WORDS if word[:1] != "<" or word in ("<pad>", "<unk>"))
    with pytest.raises(ValueError, match=r"play the scenario with \+marked"):
        SpeakersNet(NetSpec((4, 2, 2, 3), (7, 7, 4), (11, 5, 2, 3), words))


def test_what_a_named_speaker_said_last_scales_the_cells_it_mentions() -> None:
    """A door of the colour looks as any other until somebody who is trusted mentions it."""
    spec = NetSpec((4, 2, 2, 3), (7, 7, 4), (11, 5, 2, 3), WORDS)
    torch.manual_seed(0)
    net = SpeakersNet(spec)
    with torch.no_grad():
        net.trust.copy_(torch.tensor([0.0, 0.2]))
        for weights in (net.lines, net.dialogue.get_parameter("each.0.summed"), net.chosen.weight):
            weights.zero_()
    lines = {
        "nothing": [],
        "by one who was not named": [["<Ann>", "red"]],
        "by one who was": [["<Ann>", "red"], ["<Old Bob>", "ann"]],
        "not in the last line": [["<Ann>", "red"], ["<Old Bob>", "ann"], ["<Ann>", "hello"]],
    }
    rows = [[WORDS.index(word) for line in said for word in line] for said in lines.values()]
    text = net.dialogue(prefix_tree(np.array([row + [0] * (20 - len(row)) for row in rows])))
    images = torch.zeros(1, 7, 7, 4, dtype=torch.uint8)
    images[0, 3, 3] = torch.tensor([4, 0, 1, 0])  # red
    count = torch.arange(len(rows))
    nothing, unnamed, named, earlier = net.perceive(net.prepare(images), text, count * 0, count)
    assert torch.equal(nothing, unnamed)
    assert torch.equal(nothing, earlier)
    assert not torch.allclose(nothing, named)
