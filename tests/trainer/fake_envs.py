"""A tiny vector environment with the spaces and extras the trainer relies on, whose task needs hearing and memory."""

import json
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from socialai_dsl.trainer.features import content_ids

_SAME, _DISABLED = gym.vector.AutoresetMode.SAME_STEP, gym.vector.AutoresetMode.DISABLED
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def _mix(*keys):
    """Counter-based 64-bit randomness, elementwise over broadcast integer keys."""
    with np.errstate(over="ignore"):
        state = np.uint64(0)
        for key in keys:
            state = (state ^ np.asarray(key).astype(np.uint64)) + _GOLDEN
            state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            state = state ^ (state >> np.uint64(31))
    return state


class EchoEnvs(gym.vector.VectorEnv):
    """Step 1: a voice says "say <word>". Step `delay + 1` is the moment to say that word (template 1, noun = word).

    Speaking right ends the episode with success; at any other time speaking does nothing. Episodes last at most
    `limit` steps (a time-out), and primitive 0 at the very first step ends them at once (outcome "left").
    `chatter` is the probability of an extra line of four words in a step. With `mode` Disabled nothing happens in an
    environment whose episode is over until it is reset.
    """

    seat_names = ("agent",)

    def __init__(
        self,
        num_envs,
        nouns=4,
        delay=2,
        limit=6,
        length=16,
        chatter=0.0,
        pictures=40,
        lethal=True,
        mode=_SAME,
        voice="voice",
    ):
        self.metadata = {"autoreset_mode": mode}
        self._over = np.zeros(num_envs, np.bool_)
        self.num_envs, self.nouns, self.delay, self.limit = num_envs, nouns, delay, limit
        self.length, self.chatter, self.pictures, self.lethal = length, chatter, pictures, lethal
        high = np.broadcast_to(np.array([12, 5, 3, 3], np.uint8), (7, 7, 4))
        self.vocabulary = ["<pad>", "<unk>", voice, "say", *[f"word{i}" for i in range(nouns)], "la", "di"]
        self.single_observation_space = spaces.Dict(
            image=spaces.Box(np.zeros((7, 7, 4), np.uint8), high, dtype=np.uint8),
            tokens=spaces.Box(0, len(self.vocabulary) - 1, (length,), np.int16),
        )
        self.single_action_space = spaces.MultiDiscrete([4, 2, 2, nouns])
        self.observation_space = gym.vector.utils.batch_space(self.single_observation_space, num_envs)
        self.action_space = gym.vector.utils.batch_space(self.single_action_space, num_envs)
        self.program = SimpleNamespace(
            name="echo",
            outcomes=["right", "left", "time_out"],
            vocabulary=self.vocabulary,
            sha256="0" * 64,
            session=1,
            actions=("stop", "wait", "look"),
            templates=("ask <noun>", "say <noun>"),
            nouns=tuple(f"word{i}" for i in range(nouns)),
            sentences=SimpleNamespace(used=((True,), (True,))),
        )
        kinds = np.stack([np.arange(48) % 13, np.arange(48) % 6, np.arange(48) % 3, np.arange(48) % 4], 1)
        drawn = np.random.default_rng(1).integers(0, 48, (pictures, 7, 7))
        drawn[:, :, 2:] = np.where(
            np.random.default_rng(2).random((pictures, 7, 5)) < 0.7, 0, drawn[:, :, 2:]
        )
        self._pictures = kinds.astype(np.uint8)[drawn]
        self._stats = {
            "outcomes": dict.fromkeys(self.program.outcomes, 0),
            "rules": {"speaks": 0},
            "episodes": 0,
        }
        zeros = np.zeros(num_envs, np.int64)
        self._s = {"seed": zeros.copy(), "episode": zeros.copy(), "t": zeros.copy(), "heard": zeros.copy()}
        self._tokens = np.zeros((num_envs, length), np.int16)
        self.poison = None

    def _word(self):
        return (_mix(self._s["seed"], self._s["episode"], 7) % np.uint64(self.nouns)).astype(np.int64)

    def reset(self, *, seed=None, options=None):
        s = self._s
        chosen = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, np.bool_)))
        s["t"][chosen], s["heard"][chosen], self._over[chosen] = 0, 0, False
        self._tokens[chosen] = 0
        if options and "test_episode" in options:
            s["seed"][chosen], s["episode"][chosen] = 2**40, np.asarray(options["test_episode"])[chosen]
        elif seed is not None:
            index = (options or {}).get("index", np.arange(self.num_envs))
            s["seed"][:], s["episode"][:] = np.asarray(index) + 1000 * np.asarray(seed), 0
        else:
            s["episode"] += 1
        return self._observe(), {}

    def step(self, actions):
        s, word = self._s, self._word()
        actions = np.asarray(actions)
        assert actions.shape == (self.num_envs, 4)
        alive = ~self._over
        s["t"] += alive
        t = s["t"]
        speaks = (actions[:, 1] == 1) & alive
        right = speaks & (actions[:, 2] == 1) & (actions[:, 3] == word) & (t == self.delay + 1)
        left = (t == 1) & (actions[:, 0] == 0) & self.lethal & alive
        terminated = right | left
        truncated = ~terminated & (t >= self.limit) & alive
        reward = right * (1 - 0.9 * t / self.limit)
        self._stats["rules"]["speaks"] += int(speaks.sum())
        s["heard"][:] = 0
        self._say(np.flatnonzero((t == 1) & alive), [2, 3], 4 + word, 1)
        if self.chatter:
            noisy = _mix(s["seed"], s["episode"], t, 9) % np.uint64(1000) < np.uint64(1000 * self.chatter)
            self._say(np.flatnonzero(noisy & alive), [2, 4 + self.nouns, 5 + self.nouns], 4 + word, 2)
        done = terminated | truncated
        infos = {}
        if done.any():
            final = self._observe()
            outcome = np.select([right, left], [0, 1], 2)
            for index, name in enumerate(self.program.outcomes):
                self._stats["outcomes"][name] += int((outcome[done] == index).sum())
            self._stats["episodes"] += int(done.sum())
            infos = {
                "success": right,
                "_success": done,
                "outcome": outcome,
                "_outcome": done,
                "final_obs": final,
            }
            if self.metadata["autoreset_mode"] is _DISABLED:
                self._over |= done
            else:
                s["episode"][done] += 1
                s["t"][done], s["heard"][done], self._tokens[done] = 0, 0, 0
        observation = self._observe()
        if self.poison == "reward":
            reward = reward * np.nan
        if self.poison == "image":
            observation["image"][0, 0, 0, 0] = 99
        if self.poison == "tokens":
            self._tokens[:, 0] = observation["tokens"][:, 0] = 999
        return observation, reward.astype(np.float64), terminated, truncated, infos

    def _say(self, which, words, last, kind):
        self._s["heard"][which] = kind * 100 + last[which]
        for e in which.tolist():
            line = [*words, int(last[e])]
            heard = [w for w in self._tokens[e].tolist() if w]
            while len(heard) + len(line) > self.length:
                del heard[: 3 if heard[1] == 3 else 4]
            row = heard + line
            self._tokens[e] = row + [0] * (self.length - len(row))

    def _observe(self):
        s = self._s
        picture = _mix(s["seed"], s["episode"], s["t"], 3) % np.uint64(self.pictures)
        return {"image": self._pictures[picture.astype(np.int64)], "tokens": self._tokens.copy()}

    def utterance_ids(self):
        return self._s["heard"].copy()

    def history_ids(self):
        return content_ids(self._tokens)

    def image_ids(self):
        return content_ids(self._observe()["image"])

    def counters(self):
        return json.loads(json.dumps(self._stats))

    def scripted_actions(self):
        actions = np.tile(np.array([3, 0, 0, 0]), (self.num_envs, 1))
        now = self._s["t"] == self.delay
        actions[now, 1], actions[now, 2], actions[now, 3] = 1, 1, self._word()[now]
        return actions.astype(np.int64)

    def snapshot(self):
        state = {key: value.tolist() for key, value in self._s.items()}
        return json.dumps({"s": state, "tokens": self._tokens.tolist(), "stats": self._stats}).encode()

    def restore(self, data):
        content = json.loads(data)
        self._s = {key: np.array(value, np.int64) for key, value in content["s"].items()}
        self._tokens = np.array(content["tokens"], np.int16)
        self._stats = content["stats"]
