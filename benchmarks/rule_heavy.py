"""Finds actions for `make bench` that make something happen in nearly every step.

Walking and talking at random rarely triggers a rule, so the speed under it says little of how fast rules are. Here, for
every environment and step, several actions are tried from the same state, and the one is kept after which somebody was
heard and the episode goes on. What is said is only what some rule of the scenario waits for.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.mixes import BATCHES, Actions, Allowed
from socialai_dsl.program import Header, Program

_TRIED: Final = 4
_GATHERING: Final = BATCHES
_MOST: Final = 256


@dataclass(frozen=True)
class RuleHeavy:
    """Actions that belong to a state.

    Attributes:
        start: a snapshot, from which they are to be played.
        actions: int64 (T, E, 3 + slots). T is a whole number of horizons, if they are not too long: what is chosen ends
            no episode but time does, and resets must be as frequent in what is measured as they are in the long run.
        fired: rules of the scenario that fired, per environment and step.
    """

    start: bytes
    actions: Actions
    fired: float


def rule_heavy_actions(envs: Any, allowed: Allowed, seed: int) -> RuleHeavy:
    """Actions for environments of one scenario after which an NPC speaks, wherever that can be had."""
    generator, horizon = np.random.default_rng(seed), envs.program.header(Header.HORIZON)
    spoken = _what_rules_wait_for(envs.program, allowed)
    envs.reset(seed=seed)
    for _ in range(_GATHERING):
        envs.step(_best(envs, allowed, spoken, generator))
    start, before = envs.snapshot(), envs.counters()
    actions = []
    steps = min(-(-BATCHES // horizon) * horizon, _MOST)
    for _ in range(steps):
        actions.append(_best(envs, allowed, spoken, generator))
        envs.step(actions[-1])
    after = envs.counters()
    fired = sum(after["rules"].values()) - sum(before["rules"].values())
    return RuleHeavy(start, np.stack(actions), fired / (steps * envs.num_envs))


def _what_rules_wait_for(program: Program, allowed: Allowed) -> Actions:
    """The harmless utterances that some rule waits for, int64 (U, 1 + slots); all harmless ones if there are none."""
    spoken, table, sentences = allowed.utterances, program.table(Header.CLASS_AT), program.sentences
    used = np.array(sentences.used)[spoken[:, 0]]
    lacking = np.array([len(slot.words) for slot in sentences.slots])
    fillings = (np.where(used, spoken[:, 1:], lacking) * sentences.strides).sum(1)
    classes = table[spoken[:, 0], fillings]
    return spoken[classes > 1] if (classes > 1).any() else spoken


def _best(envs: Any, allowed: Allowed, spoken: Actions, generator: np.random.Generator) -> Actions:
    """Of some random actions for each environment one that is answered and ends nothing; what is tried is undone."""
    now = envs.snapshot()
    best = np.zeros(envs.action_space.shape, np.int64)
    merit = np.full(envs.num_envs, -1)
    for _ in range(_TRIED):
        tried = np.zeros_like(best)
        tried[:, 0] = generator.choice(allowed.primitives, envs.num_envs)
        if len(spoken):
            tried[:, 1] = 1
            tried[:, 2:] = generator.choice(spoken, envs.num_envs)
        _, _, terminated, truncated, _ = envs.step(tried)
        worth = 2 * (envs.utterance_ids() != 0) + ~(terminated | truncated)
        better = worth > merit
        best[better], merit[better] = tried[better], worth[better]
        envs.restore(now)
    return best
