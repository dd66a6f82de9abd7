"""What the network `relations` hears agrees with reading histories from their first word."""

import pytest
import torch

from tests.trainer.nets.test_dialogue import conversations, encode_one_by_one, encode_tree
from trainer.nets import NetSpec
from trainer.nets.dialogue import prefix_tree
from trainer.nets.relations import HeardLines, RelationsNet
from trainer.nets.sight import MapSight, Sight

WORDS = ("<pad>", "<unk>", "<Ann>", "<Bob>", "ann", "bob", "yes", "no", "hello", "red", "blue", "door")


@pytest.fixture
def encoder() -> HeardLines:
    torch.manual_seed(0)
    return HeardLines(WORDS, 16, 24).double()


def test_tree_agrees_with_reencoding_in_values_and_gradients(encoder: HeardLines) -> None:
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


class Fewer(RelationsNet):
    parts = frozenset(("order",))


@pytest.mark.parametrize(("net", "sight"), [(RelationsNet, MapSight), (Fewer, Sight)])
def test_a_subclass_may_have_fewer_parts(net: type[RelationsNet], sight: type[Sight]) -> None:
    made = net(NetSpec((4, 2, 2, 3), (7, 7, 4), (11, 5, 2, 3), WORDS))
    assert type(made.sight) is sight
    assert hasattr(made, "forms") == (net is RelationsNet)
    images = torch.zeros(3, *made.sight.shape, dtype=torch.uint8)
    text = made.dialogue(prefix_tree(conversations(2, 12)))
    index = torch.arange(len(text))
    found = made.perceive(made.prepare(images), text, index % 3, index)
    assert found.shape == (len(text), made.features)
    found.sum().backward()  # type: ignore[no-untyped-call]
