"""The engine and the reference interpreter agree on scenarios that nobody has written: random files of the language."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.envs.asking import Asker
from socialai_dsl.envs.audit import first_unsound
from socialai_dsl.frontend import load
from socialai_dsl.program.program import bounds_of
from tests.agreement import Pair, questions_agree
from tests.quick import one_in
from tests.reference.interpreter import Reference
from tests.reference.vocabulary import LONGEST, Words
from tests.scenario_fuzzer import write, write_asking, write_furnished


def compare(folder: Path, seed: int, episodes: int, furnished: bool = False) -> int:
    """Write, check and play the scenario of a seed, perhaps in several files, on both sides; the number of steps."""
    for name, text in (write_furnished(seed) if furnished else {f"random_{seed}.yaml": write(seed)}).items():
        (folder / name).write_text(text, encoding="utf-8")
    pair = Pair.of(load(str(folder / f"random_{seed}.yaml")), number_words=False)
    rng = np.random.default_rng(seed)
    return sum(pair.play(seed, episode, rng) for episode in range(episodes))


@pytest.mark.parametrize(
    "first", one_in(3, range(0, 80, 10), "plays random scenarios on the slow interpreter")
)
def test_random_scenarios_agree(tmp_path: Path, first: int) -> None:
    steps = [compare(tmp_path, seed, episodes=1) for seed in range(first, first + 10)]
    assert sum(steps) > 10 * 5, "the episodes were too short to mean anything"


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("first", range(0, 10_000, 500))
def test_ten_thousand_random_scenarios_agree(tmp_path: Path, first: int) -> None:
    for seed in range(first, first + 500):
        compare(tmp_path, seed, episodes=2)


@pytest.mark.parametrize(
    "first", one_in(3, range(50_000, 50_060, 10), "plays random scenarios on the slow interpreter")
)
def test_random_scenarios_of_several_files_agree(tmp_path: Path, first: int) -> None:
    steps = [compare(tmp_path, seed, episodes=2, furnished=True) for seed in range(first, first + 10)]
    assert sum(steps) > 10 * 10, "the episodes were too short to mean anything"


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("first", range(50_000, 53_000, 500))
def test_three_thousand_random_scenarios_of_several_files_agree(tmp_path: Path, first: int) -> None:
    for seed in range(first, first + 500):
        compare(tmp_path, seed, episodes=2, furnished=True)


def compare_questions(folder: Path, seed: int) -> int:
    """Ask the probes of a seed's scenario on both sides; the number of questions."""
    path = folder / f"random_{seed}.yaml"
    path.write_text(write_asking(seed), encoding="utf-8")
    loaded, env, rng = load(str(path)), sd.make(str(path)), np.random.default_rng(seed)
    words = Words({word: number for number, word in enumerate(env.program.vocabulary)}, LONGEST)
    reference = Reference(loaded.resolved, words)
    return questions_agree(
        env, Asker(loaded), reference, seed, lambda: [rng.integers(0, size) for size in env.action_space.nvec]
    )


def test_random_probes_agree(tmp_path: Path) -> None:
    assert sum(compare_questions(tmp_path, seed) for seed in range(12)) > 12


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("first", range(0, 2_000, 200))
def test_two_thousand_random_scenarios_ask_alike(tmp_path: Path, first: int) -> None:
    for seed in range(first, first + 200):
        compare_questions(tmp_path, seed)


def play_within(folder: Path, seed: int, steps: int) -> int:
    """Play the program of a seed's scenario, and find every register within what was proven of it; how many moved."""
    path = folder / f"random_{seed}.yaml"
    path.write_text(write(seed), encoding="utf-8")
    envs = sd.make_vec(str(path), num_envs=8)
    envs.action_space.seed(seed)
    envs.reset(seed=seed)
    (program,), state = envs.programs, envs._table.state
    low, high = np.array(bounds_of(program).of_register).T
    least = most = state.registers[:, : len(low)].copy()
    for step in range(steps):
        envs.step(envs.action_space.sample())
        values = state.registers[:, : len(low)]
        least, most = np.minimum(least, values), np.maximum(most, values)
        if step % 10 == 9:
            assert (unsound := first_unsound(program, state.registers)) is None, f"seed {seed}: {unsound}"
    outside = np.flatnonzero((least < low).any(axis=0) | (most > high).any(axis=0))
    envs.close()
    assert not len(outside), (
        f"seed {seed}: register {outside[0]} was {least[:, outside[0]].min()} to {most[:, outside[0]].max()}, "
        f"proven {low[outside[0]]} to {high[outside[0]]}"
    )
    return int((least != most).any(axis=0).sum())


@pytest.mark.thorough("plays thirty random scenarios")
def test_registers_stay_within_the_proven_intervals(tmp_path: Path) -> None:
    moved = [play_within(tmp_path, seed, steps=40) for seed in range(100_000, 100_030)]
    assert min(moved) > 1, "hardly anything happened"
    assert sum(moved) > 30 * 10, "hardly anything happened"


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("first", range(200_000, 210_000, 500))
def test_registers_of_ten_thousand_programs_stay_within_the_proven_intervals(
    tmp_path: Path, first: int
) -> None:
    for seed in range(first, first + 500):
        play_within(tmp_path, seed, steps=40)


def test_a_seed_makes_one_scenario() -> None:
    assert write(7) == write(7)
    assert write(7) != write(8)


def test_where_only_the_agent_follows_a_frame_it_waits_for_no_npc(tmp_path: Path) -> None:
    path = tmp_path / "random_680.yaml"
    path.write_text(write(680), encoding="utf-8")
    assert {frame.member for frame in load(str(path)).checked.frames if frame.written} == {"agent"}


SPOKEN_OF = (
    *("hears: any", "<noun>", "speaker", "heard(", "agent.said(", "agent.noun", ".spoke"),
    *("goto_now:", "once: true", "chance:", "after:", "until:", "perform(", "memory:", "tables:", "state:"),
    *(
        "prev(",
        "pick(",
        "nearest(",
        "count(",
        " in cells where ",
        "believes.",
        "beliefs:",
        "from:",
        "forget:",
        "start: none",
        "toggled_by(",
    ),
    *(
        "from:",
        "forget:",
        "start: none",
        "for: cast",
        "(those(",
        "addressed: true",
        "overheard: false",
        " to: ",
    ),
    *(
        "timer:",
        "exclusive: true",
        "unlocks:",
        "opens:",
        "inside:",
        "pushed_by: marble",
        "locked:",
        "tagged:",
    ),
    *("pushed_by: anybody", "push(ann", "push(agent"),
    *(
        "carryable: true",
        "pickup",
        "drop",
        "fetch(",
        "give(",
        "bring(",
        ".carries(",
        ".carried",
        ".empty_handed",
        "accepts:",
    ),
    *("looks:", "words:", "tone:", ".size ==", ".mood !=", ".mood:", ".pattern ==", "random"),
    *(".move_into(", ".put(", ".reset", ".vanish", ".become(", ".reveal", "push(", "use(", "enter(", "flee("),
    *("slots:", "define:", "require:", "order:", "occlusion: true", "npcs: hidden", "image: before_npcs"),
    *(
        "pointing",
        "point_at(",
        "pointing_right",
        "egocentric",
        "own_voice: true",
        "lines: marked",
        "reward:",
        "each_step:",
        "would_see(",
        "joint_attention(",
    ),
    *(" if ", " else ", "repeat:", "while:"),
    *("vault(code)", "hoard:", "32768", "1000000000"),
)
"""What authors can write, and what the random scenarios of the ordinary suite are to contain."""


SPOKEN_OF_IN_SEVERAL_FILES = (
    *("npc: ", "one_of:", "roles:", "role: ", "npc_defaults:", "params:", "values:", "$late", "$there"),
    *("  at:", "name: ", "kind_code:", "width:", "height:", "pressed:", "opened:", "unlocked_by"),
    *("top_half", "bottom_half", "nowhere", "toward(agent)", "for: ever"),
)
"""What is added where a scenario is written in several files."""


def test_random_scenarios_speak_of_most_of_the_language() -> None:
    texts = [write(seed) for seed in range(200)]
    missing = [word for word in SPOKEN_OF if not any(word in text for text in texts)]
    assert not missing
    files = [file for seed in range(50_000, 50_060) for file in write_furnished(seed).values()]
    missing = [word for word in SPOKEN_OF_IN_SEVERAL_FILES if not any(word in text for text in files)]
    assert not missing
    assert all(re.match(r"scenario: random_\d+\n", text) for text in texts)
