"""Networks have the published sizes, share frames exactly, and are found by name."""

import numpy as np
import pytest
import torch
from torch.nn import functional

import socialai_dsl as sd
from socialai_dsl.trainer.nets import NetSpec, build_net, net_class
from socialai_dsl.trainer.nets.base import unit_row_linear
from socialai_dsl.trainer.nets.fast import Cells, FastNet
from socialai_dsl.trainer.nets.paper import PaperNet

WORDS = ("<pad>", "<unk>", *(a + b for a in "abcdef" for b in "ghijkl"), "it's", "3")
SPEC = NetSpec((8, 2, 4, 16), (7, 7, 4), (12, 5, 3, 3), WORDS)


def random_images(count: int) -> torch.Tensor:
    high = np.array(SPEC.image_high) + 1
    return torch.from_numpy(np.random.default_rng(0).integers(0, high, (count, 7, 7, 4)).astype(np.uint8))


@pytest.mark.parametrize(
    ("action_sizes", "parameters"),
    [
        ((8, 2, 4, 16), 1_097_503),
        ((8, 2, 2, 2), 1_096_463),
        ((4, 2, 2, 2), 1_096_203),
        ((8, 2, 15, 45), 1_100_103),
    ],
)
def test_the_reference_network_has_the_published_number_of_parameters(
    action_sizes: tuple[int, int, int, int], parameters: int
) -> None:
    net = build_net("paper-reference", NetSpec(action_sizes, (7, 7, 4), (12, 5, 3, 3), WORDS), 0)
    assert sum(p.numel() for p in net.parameters()) == parameters


def test_the_reference_network_s_parts_have_the_published_sizes() -> None:
    net = build_net("paper-reference", SPEC, 0)
    assert isinstance(net, PaperNet)

    def size(module: torch.nn.Module) -> int:
        return sum(p.numel() for p in module.parameters())

    assert size(net.image_conv) == 152_832
    assert size(net.dialogue.embedding) == 12_800
    assert size(net.dialogue.gru) == 99_072
    assert [size(block) for block in net.blocks] == [328_704, 328_704]
    assert size(net.memory) == 132_096
    critic = net.heads.hidden.weight[:64].numel() + 64 + size(net.heads.out[4])
    assert critic == 8_321


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("talkitout", 1_097_503),
        ("diverse_exit", 1_097_503),
        ("showme", 1_096_463),
        ("help", 1_096_463),
        ("dance", 1_096_203),
        ("cointhief", 1_096_463),
        ("social_env", 1_100_103),
    ],
)
def test_the_reference_network_of_each_scenario_has_the_published_size(name: str, parameters: int) -> None:
    envs = sd.make_vec(f"{name}+as_coded", 1)
    net = build_net("paper-reference", NetSpec.of(envs), 0)
    envs.close()
    assert sum(p.numel() for p in net.parameters()) == parameters


def test_a_linear_layer_is_drawn_row_by_row_on_the_unit_sphere() -> None:
    layer = torch.nn.Linear(2, 3)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(5)
        drawn = torch.empty(3, 2).normal_()
        torch.manual_seed(5)
        unit_row_linear(layer)
    lengths = [(a * a + b * b) ** 0.5 for a, b in drawn.tolist()]
    expected = [[a / n, b / n] for (a, b), n in zip(drawn.tolist(), lengths, strict=True)]
    assert np.allclose(layer.weight.detach().numpy(), expected, atol=1e-6)
    assert layer.bias.tolist() == [0, 0, 0]


def test_only_linear_layers_of_the_reference_network_are_drawn_so() -> None:
    net = build_net("paper-reference", SPEC, 0)
    linear = [module for module in net.modules() if isinstance(module, torch.nn.Linear)]
    assert len(linear) == 4 + 6, (
        "scale and shift of two blocks, the heads' first layers as one, five last ones"
    )
    for layer in linear:
        assert torch.allclose(layer.weight.norm(dim=1), torch.ones(len(layer.weight)))
        assert (layer.bias == 0).all()
    bound = 128**-0.5  # PyTorch's default: uniform up to 1 / sqrt(size of the state)
    for module in (net.dialogue.gru, net.memory.cell):
        for weight in module.parameters():
            assert 0.9 * bound < weight.abs().max() <= bound
    assert 0.95 < net.dialogue.embedding.weight.std() < 1.05, "normal, the padding's row too"
    assert net.dialogue.embedding.weight[0].abs().max() > 0


def test_linear_layers_of_the_paper_network_start_with_unit_rows() -> None:
    net = build_net("paper", SPEC, 0)
    assert isinstance(net, PaperNet)
    for layer in (net.heads.hidden, net.heads.out[0], net.blocks[0].scale):
        assert torch.allclose(layer.weight.norm(dim=1), torch.ones(len(layer.weight)))
        assert (layer.bias == 0).all()


def test_looking_up_kinds_is_reading_every_cell() -> None:
    torch.manual_seed(0)
    net = FastNet(SPEC).double()
    with torch.no_grad():
        net.mentions.normal_()
    images, heard = random_images(5), torch.zeros(3, len(WORDS)).double()
    heard[0, 3] = heard[0, 7] = heard[2, 4] = 1
    state = torch.randn(3, 128).double()
    text = torch.cat((state, heard), 1)
    image_index, text_index = torch.arange(5), torch.tensor([2, 0, 0, 2, 2])
    got = net.perceive(net.prepare(images), text, image_index, text_index)
    embedded = net.channels[torch.arange(4), images.flatten(1, 2).long()].sum(2)  # (5, 49, kind_size)
    codes = images.flatten(1, 2).long()
    of_words = net.mentions[:, torch.arange(4), codes].sum(3)  # (V, 5, 49)
    mentioned = (heard[text_index].T[:, :, None] * of_words).sum(0)
    scale, shift = net.film(state[text_index])[:, None].chunk(2, 2)
    read = torch.relu(embedded * (1 + scale + mentioned[:, :, None]) + shift)
    said = functional.linear(state[text_index], net.words.weight)
    expected = torch.relu(functional.linear(read.flatten(1), net.cells.weight, net.cells.bias) + said)
    assert torch.allclose(got, expected, rtol=0, atol=1e-12)
    parameters = [net.channels, net.film.weight, net.cells.weight, net.words.weight, net.mentions]
    for one, other in zip(
        torch.autograd.grad(got.square().sum(), parameters, retain_graph=True),
        torch.autograd.grad(expected.square().sum(), parameters),
        strict=True,
    ):
        assert torch.allclose(one, other, rtol=0, atol=1e-10)


def test_kinds_of_cells_are_told_apart_by_every_channel() -> None:
    images = torch.zeros(5, 7, 7, 4, dtype=torch.uint8)
    for channel, value in enumerate(SPEC.image_high):
        images[channel + 1, 2, 3, channel] = value
    view = Cells(images, tuple(high + 1 for high in SPEC.image_high))
    assert len(view.kinds) == 5
    assert len(set(view.kind_of[:, 2 * 7 + 3].tolist())) == 5


@pytest.mark.parametrize("more", [0, 4, 11, 40])
def test_every_cell_is_of_the_kind_that_it_shows(more: int) -> None:
    """Also if the numbers of all channels together would not fit into 64 bits."""
    sizes = (*(high + 1 for high in SPEC.image_high), *(256,) * more)
    further = torch.randint(254, 256, (4, 7, 7, more), generator=torch.Generator().manual_seed(more))
    images = torch.cat((random_images(4), further.to(torch.uint8)), 3)
    view = Cells(images, sizes)
    assert torch.equal(view.kinds[view.kind_of], images.flatten(1, 2).to(torch.int64))
    assert len(view.kinds.unique(dim=0)) == len(view.kinds)


@pytest.mark.parametrize("name", ["fast", "paper"])
def test_shared_frames_have_the_features_of_separate_ones(name: str) -> None:
    net = build_net(name, SPEC, 0).double()
    images, text = random_images(3), torch.randn(2, net.dialogue.size).double()
    image_index, text_index = torch.tensor([0, 2, 2, 1, 0, 0]), torch.tensor([0, 1, 0, 1, 0, 1])
    together = net.perceive(net.prepare(images), text, image_index, text_index)
    apart = torch.cat(
        [
            net.perceive(
                net.prepare(images[i : i + 1]), text[j : j + 1], torch.tensor([0]), torch.tensor([0])
            )
            for i, j in zip(image_index.tolist(), text_index.tolist(), strict=True)
        ]
    )
    assert together.shape == (6, net.features)
    assert torch.allclose(together, apart, rtol=0, atol=1e-10)


def test_convolutions_are_asked_for_few_numbers_of_images() -> None:
    """Each new one is compiled by PyTorch and kept until the process ends."""
    net = PaperNet(SPEC, width=8)
    seen: set[int] = set()
    for convolution in (net.image_conv[0], net.blocks[0].conv1):
        convolution.register_forward_hook(lambda _, given, __: seen.add(len(given[0])))
    text = torch.zeros(1, net.dialogue.size)
    for count in (1, 2, 7, 8, 9, 63, 64, 65, 100, 128):
        rows = torch.arange(count)
        features = net.perceive(net.prepare(random_images(count)), text, rows, torch.zeros_like(rows))
        assert len(features) == count
    assert seen == {8, 16, 64, 128}


def test_bfloat16_changes_how_paper_computes_and_not_what_it_is() -> None:
    plain, reduced = (build_net("paper", SPEC, 0, precision) for precision in ("float32", "bfloat16"))
    images, text = random_images(8), torch.randn(3, 128, generator=torch.Generator().manual_seed(0))
    index = torch.arange(8)
    results = []
    for net in (plain, reduced):
        features = net.perceive(net.prepare(images), text, index, index % 3)
        features.square().sum().backward()
        results.append((features.detach(), [parameter.grad for parameter in net.parameters()]))
    (exact, exact_grads), (rounded, rounded_grads) = results
    assert rounded.dtype == torch.float32
    assert not torch.equal(exact, rounded)  # or it would not have been reduced
    # bfloat16 keeps 8 bits, and five convolutions in a row add their errors.
    assert (exact - rounded).norm() < 0.03 * exact.norm()
    assert all(value.dtype == torch.float32 for value in reduced.state_dict().values())
    for one, other in zip(exact_grads, rounded_grads, strict=True):
        if one is not None:
            assert other is not None
            assert other.dtype == torch.float32
            assert (one - other).norm() < 0.1 * one.norm()


def test_bfloat16_is_for_networks_that_can() -> None:
    for name in ("fast", "paper-reference"):
        with pytest.raises(ValueError, match=f"{name}, which computes in float32 only"):
            build_net(name, SPEC, 0, "bfloat16")


def test_equal_seeds_build_equal_networks_and_leave_torch_s_generator_alone() -> None:
    state = torch.get_rng_state()
    one, other, third = (build_net("fast", SPEC, seed).state_dict() for seed in (3, 3, 4))
    assert torch.equal(torch.get_rng_state(), state)
    assert all(torch.equal(one[name], other[name]) for name in one)
    assert not all(torch.equal(one[name], third[name]) for name in one)


@pytest.mark.parametrize(
    "name", ["slow", "no_such_module_here:Net", "socialai_dsl.trainer.nets:Nothing", ":", "a:"]
)
def test_an_unknown_network_is_a_value_error(name: str) -> None:
    with pytest.raises(ValueError, match="net: "):
        net_class(name)
