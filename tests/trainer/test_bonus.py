"""The exploration bonus pays what the published formula says."""

from collections import Counter
from math import tanh
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs.table import HeardLines
from socialai_dsl.trainer.bonus import BatchStep, EpisodicBonus, LineBonus, cell_codes
from socialai_dsl.trainer.config import RunConfig

IMAGE = np.zeros((2, 7, 7, 4), np.uint8)


class Bonus(EpisodicBonus):
    """Asked of steps of which only what is heard, seen and ended matters."""

    def __init__(self, config: RunConfig, num_envs: int) -> None:
        super().__init__(config, num_envs)
        self.config, self.num_envs = config, num_envs

    def pay(self, envs: Any, image: np.ndarray, ended: np.ndarray, **now: float) -> np.ndarray:
        actions, zeros = np.zeros((self.num_envs, 4), np.int64), np.zeros(self.num_envs)
        config = self.config.model_copy(update=now)
        return self.step(
            BatchStep(envs, image, actions, zeros, ended, zeros > 0, zeros > 0, config, progress=0.0)
        )


def hears(*ids: int) -> SimpleNamespace:
    return SimpleNamespace(utterance_ids=lambda: np.array(ids, np.int64))


def ended(*marks: int) -> np.ndarray:
    return np.array(marks, np.bool_)


def test_first_silence_and_first_utterances_pay_and_repetitions_do_not() -> None:
    bonus = Bonus(RunConfig(bonus="lang", bonus_c=7.0), 2)
    first = 0.6 * tanh(7 / 40)
    assert first == pytest.approx(0.10394, abs=1e-5)
    assert bonus.pay(hears(0, 0), IMAGE, ended(0, 0)) == pytest.approx([first, first])
    assert bonus.pay(hears(0, 99), IMAGE, ended(0, 0)) == pytest.approx([0, first], abs=1e-12)
    assert bonus.pay(hears(-3, 99), IMAGE, ended(0, 0)) == pytest.approx([first, 0], abs=1e-12)


def test_a_second_visit_pays_next_to_nothing() -> None:
    """tanh(x) is x for small x: 0.6 * 0.175 / 2 ** 50."""
    bonus = Bonus(RunConfig(bonus="lang", bonus_c=7.0), 1)
    got = [bonus.pay(hears(0), IMAGE[:1], ended(0))[0] for _ in range(2)]
    assert got[0] == pytest.approx(0.10394, abs=1e-5)
    assert got[1] == pytest.approx(9.3e-17, rel=1e-2, abs=0)


@pytest.mark.parametrize(("c", "paid"), [(7.0, 0.10394), (20.0, 0.27727)])
def test_the_published_scales_of_the_language_bonus(c: float, paid: float) -> None:
    bonus = Bonus(RunConfig(bonus="lang", bonus_c=c), 1)
    assert bonus.pay(hears(3), IMAGE[:1], ended(0))[0] == pytest.approx(paid, abs=1e-5)


def test_the_scale_is_that_of_the_moment() -> None:
    bonus = Bonus(RunConfig(bonus="lang", bonus_c=7.0), 1)
    assert bonus.pay(hears(3), IMAGE[:1], ended(0), bonus_c=20.0)[0] == pytest.approx(0.27727, abs=1e-5)


def test_the_bonus_as_printed() -> None:
    """tanh(C / ((N + 1) ** M * T)): C = .3, T = .6, M = 1 give .5, then .25; silence is nobody's response."""
    config = RunConfig(bonus="lang", bonus_c=0.3, bonus_m=1.0, bonus_t=0.6, bonus_formula="as_printed")
    bonus = Bonus(config, 1)
    got = [bonus.pay(hears(id_), IMAGE[:1], ended(0))[0] for id_ in (0, 5, 0, 5, 6)]
    assert got == pytest.approx([0, tanh(0.5), 0, tanh(0.25), tanh(0.5)])
    bonus = Bonus(config.model_copy(update={"bonus": "cell"}), 1)
    image = IMAGE[:1].copy()
    image[0, 0, 0] = (4, 1, 0, 0)
    assert bonus.pay(hears(0), image, ended(0))[0] == pytest.approx(tanh(1.0)), "two kinds of cells, .5 each"


def test_ids_pay_what_counting_the_strings_would() -> None:
    """The code counts what it heard as text; a real scenario, played at random, several lines at once included."""
    envs = sd.make_vec("talkitout+as_coded", 32, autoreset_mode="SameStep")
    rng = np.random.default_rng(0)
    bonus = Bonus(RunConfig(bonus="lang", bonus_c=7.0, bonus_m=2.0), 32)
    counts: list[Counter[str]] = [Counter() for _ in range(32)]
    heard: set[str] = set()
    observation, _ = envs.reset(seed=0)
    greet, ask = (3, 3), (0, 1)  # "How are you", "Where is the exit"
    for step in range(300):
        actions = np.ones((32, 4), np.int64)
        actions[:, 0] = rng.choice([0, 1, 2, 7], 32)
        actions[:, 2:] = ask if step % 2 else greet
        observation, _, terminated, truncated, _ = envs.step(actions)
        done = terminated | truncated
        got = bonus.pay(envs, observation["image"], done)
        for e, text in enumerate(envs.utterances()):
            paid = 0 if done[e] else 0.6 * tanh(7 / 40 / (counts[e][text] + 1) ** 2)
            assert got[e] == pytest.approx(paid, abs=1e-12), f"step {step}, environment {e}"
            counts[e] = Counter() if done[e] else counts[e] + Counter([text])
            heard.add(text)
    envs.close()
    assert "NA" in heard
    assert len(heard) > 20, "there must be enough to tell apart"
    assert any("\n" in text for text in heard), "several spoke at once"


def test_an_episode_s_end_pays_nothing_and_forgets() -> None:
    bonus = Bonus(RunConfig(bonus="lang"), 2)
    bonus.pay(hears(5, 5), IMAGE, ended(0, 0))
    assert bonus.pay(hears(7, 7), IMAGE, ended(1, 0))[0] == 0
    again = bonus.pay(hears(5, 5), IMAGE, ended(0, 0))
    assert again == pytest.approx([0.6 * tanh(7 / 40), 0], abs=1e-12)


def test_small_powers_pay_repetitions_less() -> None:
    bonus = Bonus(RunConfig(bonus="lang", bonus_c=4.0, bonus_m=1.0, bonus_t=2.0), 1)
    got = [bonus.pay(hears(5), IMAGE[:1], ended(0))[0] for _ in range(3)]
    assert got == pytest.approx([2 * tanh(0.1), 2 * tanh(0.05), 2 * tanh(0.1 / 3)])


def test_cells_pay_for_each_new_kind_in_the_image() -> None:
    bonus = Bonus(RunConfig(bonus="cell", bonus_c=3.0), 2)
    image = IMAGE.copy()
    image[0, 0, 0] = (4, 1, 0, 0)
    image[0, 3, 3] = (4, 1, 0, 0)
    image[0, 5, 5] = (4, 2, 0, 0)
    assert bonus.pay(hears(0, 0), image, ended(0, 0)) == pytest.approx(
        [0.6 * tanh(3 * 0.075), 0.6 * tanh(0.075)]
    ), "three kinds of cells, then one"
    image[0, 6, 6] = (4, 2, 0, 3)
    assert bonus.pay(hears(0, 0), image, ended(0, 0)) == pytest.approx([0.6 * tanh(0.075), 0], abs=1e-12)


def test_cells_are_counted_as_a_plain_dictionary_would() -> None:
    rng = np.random.default_rng(0)
    bonus = Bonus(RunConfig(bonus="cell", bonus_c=3.0, bonus_m=2.0), 3)
    counts: list[dict[bytes, int]] = [{} for _ in range(3)]
    for _ in range(60):
        image = rng.integers(0, 3, (3, 7, 7, 4)).astype(np.uint8)
        image[:, 2:] = 0
        ends = rng.random(3) < 0.1
        got = bonus.pay(hears(0, 0, 0), image, ends)
        for e in range(3):
            kinds = {cell.tobytes() for cell in image[e].reshape(-1, 4)}
            terms = sum(3 / 40 / (counts[e].get(kind, 0) + 1) ** 2 for kind in kinds)
            assert got[e] == pytest.approx(0 if ends[e] else 0.6 * tanh(terms), abs=1e-12)
            counts[e] = {} if ends[e] else counts[e] | {kind: counts[e].get(kind, 0) + 1 for kind in kinds}


def test_a_saved_bonus_continues_exactly() -> None:
    rng = np.random.default_rng(1)
    steps = [(rng.integers(0, 9, 2), rng.random(2) < 0.2) for _ in range(40)]
    whole, half = (Bonus(RunConfig(bonus="lang", bonus_m=1.0), 2) for _ in range(2))
    for ids, ends in steps[:20]:
        whole.pay(hears(*ids), IMAGE, ends)
        half.pay(hears(*ids), IMAGE, ends)
    other = Bonus(RunConfig(bonus="lang", bonus_m=1.0), 2)
    other.load_state(half.state())
    for ids, ends in steps[20:]:
        assert (whole.pay(hears(*ids), IMAGE, ends) == other.pay(hears(*ids), IMAGE, ends)).all()


LINES = ("I am fine.", "Take the red door.", "Take the blue door.", "Yes.", "No.", "Take the blue coin now.")


def pay_for_lines(
    bonus: LineBonus,
    said: list[list[tuple[int, int]]],
    ends: np.ndarray,
    late: np.ndarray | None = None,
    scale: float = 0.1,
) -> list[float]:
    """What each environment is paid, where (speaker, line) pairs are heard."""
    most = max(map(len, said))
    padded = np.array([[*pairs, *[(-1, -1)] * (most - len(pairs))] for pairs in said], np.int64)
    heard = HeardLines(*np.moveaxis(padded.reshape(len(said), most, 2), 2, 0))
    envs = SimpleNamespace(heard_lines=lambda: heard, lines=LINES)
    config, zeros = RunConfig(bonus="lines", bonus_c=scale), np.zeros(len(said))
    actions = np.zeros((len(said), 4), np.int64)
    how = ends, zeros > 0, ends & False if late is None else late
    step = BatchStep(envs, IMAGE[: len(said)], actions, zeros, *how, config, progress=0.0)
    return bonus.step(step).tolist()


def test_a_line_pays_once_for_each_speaker_and_one_that_differs_in_a_word_is_no_other() -> None:
    bonus = LineBonus(RunConfig(bonus="lines"), 2)
    go_on = ended(0, 0)
    assert pay_for_lines(bonus, [[(1, 0)], []], go_on) == [0.1, 0]
    assert pay_for_lines(bonus, [[(1, 0)], [(2, 1)]], go_on) == [0, 0.1]
    assert pay_for_lines(bonus, [[(2, 0), (1, 1)], [(2, 2)]], go_on) == [0.2, 0]
    assert pay_for_lines(bonus, [[(1, 3)], [(2, 5)]], go_on, scale=0.5) == [0.5, 0.5]
    assert pay_for_lines(bonus, [[(1, 4)], [(0, 0)]], go_on) == [0, 0], (
        "what the agent says itself pays nothing"
    )


def test_lines_are_new_again_in_the_next_episode_and_its_end_pays_nothing() -> None:
    bonus = LineBonus(RunConfig(bonus="lines"), 2)
    assert pay_for_lines(bonus, [[(1, 0)], [(1, 1)]], ended(0, 1)) == [0.1, 0]
    assert pay_for_lines(bonus, [[(1, 0)], [(1, 1)]], ended(0, 0)) == [0, 0.1]


def test_who_lets_time_run_out_pays_back_what_the_episode_paid() -> None:
    bonus = LineBonus(RunConfig(bonus="lines"), 2)
    for line in (0, 1):
        assert pay_for_lines(bonus, [[(1, line)], [(1, line)]], ended(0, 0)) == [0.1, 0.1]
    assert pay_for_lines(bonus, [[], []], ended(1, 1), ended(0, 1)) == [0, -0.2]
    assert pay_for_lines(bonus, [[], []], ended(1, 1), ended(1, 1)) == [0, 0], "nothing was paid since"


def test_a_saved_bonus_for_lines_continues_exactly() -> None:
    rng = np.random.default_rng(0)
    whole, other = (LineBonus(RunConfig(bonus="lines"), 2) for _ in range(2))
    for number in range(60):
        said = [[tuple(rng.integers((1, 0), (3, len(LINES))).tolist())] for _ in range(2)]
        ends = rng.random(2) < 0.1
        late = ends & (rng.random(2) < 0.5)
        assert pay_for_lines(whole, said, ends, late) == pay_for_lines(other, said, ends, late), number
        if number % 7 == 0:
            state, other = whole.state(), LineBonus(RunConfig(bonus="lines"), 2)
            other.load_state(state)
    with pytest.raises(ValueError, match="lines of 2 environments, expected 1"):
        LineBonus(RunConfig(bonus="lines"), 1).load_state(whole.state())


def test_a_bonus_of_another_size_is_refused() -> None:
    bonus = Bonus(RunConfig(bonus="lang"), 2)
    with pytest.raises(ValueError, match="bonus: got counts"):
        bonus.load_state({"counts": np.zeros((3, 1), np.int32), "keys": np.zeros(1, np.int64)})


@pytest.mark.parametrize("channels", [4, 9, 15, 40])
def test_cell_codes_tell_channels_apart(channels: int) -> None:
    image = np.concatenate([np.eye(channels, dtype=np.uint8) * value for value in (1, 2, 128, 255)])
    codes = cell_codes(np.concatenate((image, image))[None, None])[0]
    assert len(set(codes.tolist())) == len(image)
    assert np.array_equal(codes[: len(image)], codes[len(image) :])
