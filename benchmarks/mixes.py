"""Actions of the agent for `make bench`, generated beforehand.

`random` is uniform over the action space. `walk` turns and walks and speaks half of the time, without what ends the
scenario, so that episodes last; which actions those are is found by trying, because it holds for any scenario.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import socialai_dsl

BATCHES: Final = 64
_WALKING: Final = ("left", "right", "forward", "none")
_PROBE_ENVS: Final = 1024
_PROBE_STEPS: Final = 96

Actions = NDArray[np.int64]


def random_actions(envs: Any, seed: int) -> Actions:
    """Uniform actions, int64 (BATCHES, E, 3 + slots)."""
    sizes = envs.single_action_space.nvec
    generator = np.random.default_rng(seed)
    return generator.integers(0, sizes, (BATCHES, envs.num_envs, len(sizes)))


def walk_actions(count: int, allowed: "Allowed", seed: int) -> Actions:
    """Walking and harmless talk in the scenario's own action space, int64 (BATCHES, count, 3 + slots)."""
    shape = (BATCHES, count)
    generator = np.random.default_rng(seed)
    actions = np.zeros((*shape, 2 + allowed.utterances.shape[1]), np.int64)
    actions[..., 0] = generator.choice(allowed.primitives, shape)
    if len(allowed.utterances):
        actions[..., 1] = generator.integers(0, 2, shape)
        actions[..., 2:] = generator.choice(allowed.utterances, shape)
    return actions


class Allowed:
    """What `walk` may do in a scenario.

    Attributes:
        primitives: int64 (P',), indices of left, right, forward and none, without those that end most episodes
            in the step in which they are done; none alone if all do.
        utterances: int64 (U, 1 + slots), templates and words that never ended an episode when said standing still.
    """

    def __init__(self, name: str, seed: int = 0) -> None:
        envs: Any = socialai_dsl.make_vec(name, num_envs=_PROBE_ENVS)
        sizes = [int(n) for n in envs.single_action_space.nvec]
        words = [*socialai_dsl.compile(socialai_dsl.load(name)).actions, "none"]
        walking = np.array([i for i, word in enumerate(words[: sizes[0]]) if word in _WALKING], np.int64)
        generator = np.random.default_rng(seed)
        envs.reset(seed=seed)
        self.primitives = self._probe_primitives(envs, walking, sizes[0], generator)
        self.utterances = self._probe_utterances(envs, sizes, generator)
        envs.close()

    def _probe_primitives(
        self, envs: Any, walking: Actions, count: int, generator: np.random.Generator
    ) -> Actions:
        used, ended = np.zeros(count), np.zeros(count)
        for _ in range(_PROBE_STEPS):
            actions = np.zeros(envs.action_space.shape, np.int64)
            actions[:, 0] = generator.choice(walking, _PROBE_ENVS)
            *_, terminations, _, _ = envs.step(actions)
            used += np.bincount(actions[:, 0], minlength=count)
            ended += np.bincount(actions[:, 0], terminations, minlength=count)
        # Below one half, because an action given in the step that starts the next episode is not carried out.
        harmless = walking[ended[walking] < 0.3 * used[walking]]
        return harmless if len(harmless) else walking[-1:]

    def _probe_utterances(self, envs: Any, sizes: list[int], generator: np.random.Generator) -> Actions:
        spoken = sizes[2:]
        ended = np.zeros(np.prod(spoken), bool)
        still = sizes[0] - 1
        for step in range(2 * _PROBE_STEPS):
            actions = np.zeros(envs.action_space.shape, np.int64)
            said = generator.integers(0, len(ended), _PROBE_ENVS)
            if step % 2:
                actions[:, 0], actions[:, 1] = still, 1
                actions[:, 2:] = np.stack(np.unravel_index(said, spoken), axis=1)
            else:
                actions[:, 0] = generator.choice(self.primitives, _PROBE_ENVS)
            *_, terminations, _, _ = envs.step(actions)
            if step % 2:
                ended[said[terminations]] = True
        harmless = np.flatnonzero(~ended)
        return np.stack(np.unravel_index(harmless, spoken), axis=1).astype(np.int64)


def translated(actions: Actions, name: str, program: Any) -> Actions:
    """Actions of a scenario as environments that play several with it take them: words are matched by spelling.

    Args:
        actions: int64 (..., 3 + slots), in the scenario's own action space.
        name: the scenario.
        program: what the environments play.
    """
    own: Any = socialai_dsl.compile(socialai_dsl.load(name))
    slots = {slot.name: (place, slot.words) for place, slot in enumerate(program.sentences.slots, 3)}
    columns = [
        (0, 0, (*own.actions, "none"), (*program.actions, "none")),
        (2, 2, own.templates, program.templates),
        *(
            (i, slots[slot.name][0], slot.words, slots[slot.name][1])
            for i, slot in enumerate(own.sentences.slots, 3)
        ),
    ]
    result = np.zeros((*actions.shape[:-1], 3 + len(slots)), np.int64)
    result[..., 1] = actions[..., 1]
    for source, target, words, known in columns:
        places = np.array([known.index(word) for word in words], np.int64)
        result[..., target] = places[actions[..., source]]
    return result
