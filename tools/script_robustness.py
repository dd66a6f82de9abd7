"""How well the scenarios' own scripts do, alone and with some of their actions replaced by random moves.

    python tools/script_robustness.py talkitout dance school/boxes --episodes 500 --noise 0.15

Plays `NAME+oracle` twice in the same rooms: once as the script wants, once with each action replaced, with the
probability `--noise`, by a random move (left, right or forward, as far as the scenario has them, silently). A script
that recovers from a stray move gives good advice to a learner who has strayed. One line for each scenario:

* own: share of episodes in which the script succeeds, and their mean length;
* noisy: the same with random moves; ratio: noisy / own;
* fatal: share of noisy episodes that fail in the very step of a random move (as a step forward does in CoinThief);
* mended: noisy / own without those episodes, which no script could have saved.

Without names: every shipped scenario with a variant `oracle`. Scripts whose mended ratio is below `--aim` are marked
with *, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import socialai_dsl as sd

_MOVES = ("left", "right", "forward")


@dataclass(frozen=True)
class Played:
    """What came of some episodes: success, fatal bool (E,), length int64 (E,)."""

    success: np.ndarray
    fatal: np.ndarray
    length: np.ndarray


def play(name: str, episodes: int, seed: int, noise: float) -> Played:
    """Play rooms 0 to episodes - 1 of a seed as the script does, but for random moves.

    Args:
        name: of a scenario whose agent follows a frame.
        episodes: how many to play.
        seed: of the rooms and of the random moves.
        noise: probability with which an action is replaced, 0 to 1.
    """
    envs = sd.make_vec(name, episodes, autoreset_mode="Disabled")
    envs.reset(seed=seed)
    words = list(envs.program.actions)
    moves = np.array([words.index(word) for word in _MOVES if word in words])
    generator = np.random.default_rng(seed)
    success, fatal = np.zeros(episodes, bool), np.zeros(episodes, bool)
    length = np.zeros(episodes, np.int64)
    running = np.ones(episodes, bool)
    while running.any():
        actions = envs.scripted_actions()
        replaced = generator.random(episodes) < noise
        actions[replaced] = 0
        actions[replaced, 0] = generator.choice(moves, int(replaced.sum()))
        _, _, terminated, truncated, infos = envs.step(actions)
        length += running
        ended = running & (terminated | truncated)
        if ended.any():
            success[ended] = infos["success"][ended]
            fatal[ended] = replaced[ended] & terminated[ended] & ~success[ended]
        running &= ~ended
    envs.close()
    return Played(success, fatal, length)


def shipped() -> list[str]:
    """The shipped scenarios that have a variant `oracle`, by name."""
    folder = Path(__file__).parents[1] / "scenarios"
    names = []
    for path in sorted(folder.rglob("*.yaml")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        if name.endswith("_asocial_oracle"):
            names.append(name.removesuffix("_asocial_oracle") + "+asocial")
        elif not name.endswith("_oracle"):
            names.append(name)
    return [name for name in dict.fromkeys(names) if _has_script(name)]


def _has_script(name: str) -> bool:
    try:
        sd.load(f"{name}+oracle")
    except sd.ScenarioError:
        return False
    return True


def main() -> int:
    """Print the table; 1 if a script falls short of the aim."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenarios", nargs="*", metavar="NAME", help="scenarios, without +oracle")
    parser.add_argument("--episodes", type=int, default=500, help="default: 500")
    parser.add_argument("--seed", type=int, default=0, help="default: 0")
    parser.add_argument("--noise", type=float, default=0.15, help="share of replaced actions (default: 0.15)")
    parser.add_argument("--aim", type=float, default=0.9, help="least mended ratio (default: 0.9)")
    arguments = parser.parse_args()
    names = arguments.scenarios or shipped()
    widest = max(len(name) for name in names)
    print(f"{'scenario':{widest}}    own  steps  noisy  ratio  fatal  mended")
    short = False
    for name in names:
        base, mark, parameters = name.partition("?")
        scripted = f"{base}+oracle{mark}{parameters}"
        own = play(scripted, arguments.episodes, arguments.seed, 0.0)
        noisy = play(scripted, arguments.episodes, arguments.seed, arguments.noise)
        rate = own.success.mean()
        ratio = noisy.success.mean() / rate if rate else 0.0
        mended = noisy.success[~noisy.fatal].mean() / rate if rate and not noisy.fatal.all() else 0.0
        weak = mended < arguments.aim
        short |= weak
        print(
            f"{name:{widest}}  {rate:.3f}  {own.length[own.success].mean() if rate else 0:5.1f}  "
            f"{noisy.success.mean():.3f}  {ratio:.3f}  {noisy.fatal.mean():.3f}   {mended:.3f}"
            f"{'  *' if weak else ''}",
            flush=True,
        )
    return int(short)


if __name__ == "__main__":
    sys.exit(main())
