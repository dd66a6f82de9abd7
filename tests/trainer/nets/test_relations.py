"""What the network `relations` hears agrees with reading histories from their first word."""

import numpy as np
import pytest
import torch

import socialai_dsl as sd
from socialai_dsl.trainer.nets import NetSpec
from socialai_dsl.trainer.nets.dialogue import HeardWords, prefix_tree
from socialai_dsl.trainer.nets.fast import Cells
from socialai_dsl.trainer.nets.lines import HeardOrder, Together
from socialai_dsl.trainer.nets.naming import NamingSight
from socialai_dsl.trainer.nets.relations import RelationsNet
from socialai_dsl.trainer.nets.sight import MapSight, Sight
from socialai_dsl.trainer.policy import NetPolicy
from tests.trainer.nets.test_dialogue import conversations, encode_one_by_one, encode_tree

WORDS = ("<pad>", "<unk>", "<Ann>", "<Bob>", "ann", "bob", "yes", "no", "hello", "red", "blue", "door")


@pytest.fixture
def encoder() -> Together:
    torch.manual_seed(0)
    return Together(HeardWords(len(WORDS), 16), HeardOrder(len(WORDS), 24)).double()


def test_tree_agrees_with_reencoding_in_values_and_gradients(encoder: Together) -> None:
    rows = conversations(12, 12)
    plain, tree = encode_one_by_one(encoder, rows), encode_tree(encoder, rows)
    assert torch.allclose(plain, tree, rtol=0, atol=1e-12)
    weights = torch.randn(plain.shape, dtype=torch.float64)
    named = dict(encoder.named_parameters())
    wanted, got = (
        torch.autograd.grad((each * weights).sum(), list(named.values())) for each in (plain, tree)
    )
    for name, one, other in zip(named, wanted, got, strict=True):
        assert torch.allclose(one, other, rtol=0, atol=1e-12), name


class Mapless(RelationsNet):
    parts = frozenset(("order", "speakers"))


class Nameless(RelationsNet):
    parts = RelationsNet.parts - {"names", "speakers"}


UNMARKED = tuple(word for word in WORDS if word[:1] != "<" or word in ("<pad>", "<unk>"))


@pytest.mark.parametrize("vocabulary", [WORDS, UNMARKED])
@pytest.mark.parametrize(
    ("net", "sight"), [(RelationsNet, NamingSight), (Nameless, MapSight), (Mapless, Sight)]
)
def test_every_weight_of_the_parts_that_a_network_has_learns(
    net: type[RelationsNet], sight: type[Sight], vocabulary: tuple[str, ...]
) -> None:
    made = net(NetSpec((4, 2, 2, 3), (7, 7, 4), (11, 5, 2, 3), vocabulary))
    assert type(made.sight) is sight
    assert hasattr(made, "forms") == ("pairs" in net.parts)
    assert hasattr(made, "trust") == ("speakers" in net.parts and vocabulary is WORDS)
    images = torch.ones(3, *made.sight.shape, dtype=torch.uint8)
    rows = conversations(2, 12)
    text = made.dialogue(prefix_tree(rows * 2 + (rows > 0)))
    index = torch.arange(len(text))
    found = made.perceive(made.prepare(images), text, index % 3, index)
    assert found.shape == (len(text), made.features)
    found.sum().backward()  # type: ignore[no-untyped-call]
    for name, value in made.named_parameters():
        assert value.grad is not None or name.split(".")[0] in ("memory", "heads"), name
    rows_of_words = dict(made.named_parameters())
    assert all(len(rows_of_words[name]) == len(vocabulary) for name in made.word_rows)


def test_the_name_of_a_colour_scales_its_cells_at_first_unless_it_has_to_be_learnt() -> None:
    class Learner(RelationsNet):
        lexicon = 0.0

    spec = NetSpec((4, 2, 2, 3), (7, 7, 4), (11, 5, 2, 3), WORDS)
    for net, scaled in ((RelationsNet(spec), {("red", 0), ("blue", 2)}), (Learner(spec), set())):
        found = {(WORDS[word], int(code)) for word, channel, code in net.mentions.nonzero() if channel == 1}
        assert found == scaled
        assert int((net.mentions != 0).sum()) == len(scaled)


def test_kinds_of_cells_are_counted_and_their_entries_summed() -> None:
    images = torch.zeros(2, 7, 7, 2, dtype=torch.uint8)
    images[0, 0, 0] = torch.tensor([3, 1])
    images[1, :2, 0] = torch.tensor([3, 1])
    cells = Cells(images, (4, 2))
    assert cells.kinds.tolist() == [[0, 0], [3, 1]]
    assert cells.counts.tolist() == [[3, 1], [3, 2]], "three stands for more"
    table = torch.randn(2, 256, 5)
    assert torch.equal(cells.summed(table)[1], table[0, 3] + table[1, 1])
    assert torch.equal(cells.summed(table[None], 1)[0], cells.summed(table))


def test_a_mention_is_read_where_it_is_and_by_what_words_mean_together() -> None:
    """Two histories mention the same colour; another word in one of them turns what the mention means."""

    class Where(RelationsNet):
        parts = frozenset(("pairs", "where"))

    torch.manual_seed(0)
    net = Where(NetSpec((4, 2, 2, 3), (7, 7, 4), (11, 5, 2, 3), UNMARKED))
    for table in (net.words, net.film, net.cells, net.meant):  # what does not depend on the place is silent
        torch.nn.init.zeros_(table.weight)
    rows = [["red", "yes"], ["red", "no"], ["yes"]]
    text = net.dialogue(
        prefix_tree(np.array([[UNMARKED.index(word) for word in row] + [0] * (4 - len(row)) for row in rows]))
    )
    images = torch.zeros(2, 7, 7, 4, dtype=torch.uint8)
    images[..., 1] = 5
    images[0, 1, 1], images[1, 5, 1] = torch.tensor([4, 0, 1, 0]), torch.tensor([4, 0, 1, 0])  # a red door
    index = torch.arange(6)
    left, right = net.perceive(net.prepare(images), text, index // 3, index % 3).view(2, 3, -1)
    assert not torch.allclose(left[0], left[1])
    assert not torch.allclose(left[0], right[0])
    assert torch.allclose(left[2], right[2]), "nothing was mentioned"


def test_a_map_is_of_one_room_and_a_memory_of_a_session() -> None:
    """In training and in play."""
    envs = sd.make_vec("school/color_match", 2, autoreset_mode="Disabled")
    net = RelationsNet(NetSpec.of(envs))
    policy, mask = NetPolicy(net), np.array([True, False])
    observation, _ = envs.reset(seed=0)
    policy.reset(np.ones(2, np.bool_), np.arange(2))
    for _ in range(3):
        observation, *_ = envs.step(policy.act(observation))
    before = policy.state()
    assert before["seen"].any(1).all()
    policy.enter(mask)
    after = policy.state()
    assert np.array_equal(before["memory"], after["memory"])
    assert after["seen"].any(1).tolist() == [False, True]
