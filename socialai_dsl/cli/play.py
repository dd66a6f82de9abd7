"""This module is `socialai play`: a person plays a scenario in the terminal, moving and speaking."""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.cli.errors import Exit, UsageError
from socialai_dsl.diagnostics import printable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from socialai_dsl.program_suite import Playable

SUMMARY: Final = "play a scenario yourself, from the keyboard"

HELP: Final = """\
Type a movement, an utterance, or both: `forward`, `f`, `Where is the exit`, `left How are you`.
An empty line stands still. `?` lists what can be done and said, `quit` ends the game."""


class Quit(Exception):  # noqa: N818 - not an error
    """The player has had enough."""


@dataclass
class Played:
    """An episode as it was played.

    Attributes:
        actions: int64 (4,) each.
        reward: sum of the rewards.
        success: whether it ended well.
        outcome: how it ended.
    """

    actions: "list[NDArray[np.int64]]" = field(default_factory=list)
    reward: float = 0.0
    success: bool = False
    outcome: str = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "scenario", metavar="SCENARIO", help="a path or a name, with +variants and ?parameters"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")


def execute(arguments: argparse.Namespace) -> Exit:
    """Play episode after episode until the player quits."""
    import socialai_dsl

    if arguments.seed < 0:
        raise UsageError(f"--seed: got {arguments.seed}, expected at least 0")
    program = socialai_dsl.compile(socialai_dsl.load(arguments.scenario))
    env = socialai_dsl.make(arguments.scenario, render_mode="ansi")
    print(HELP)
    reset: dict[str, Any] = {"seed": arguments.seed}
    try:
        while True:
            play_episode(env, program, reset)
            reset = {}
    except Quit:
        return Exit.GOOD
    finally:
        env.close()


def play_episode(
    env: Any, program: "Playable", reset: dict[str, Any], ask: Callable[[str], str] = input
) -> Played:
    """Let the player play one episode.

    Args:
        env: a single environment with render mode `ansi`.
        program: the scenario's.
        reset: arguments of `env.reset`.
        ask: shows a prompt and returns the player's line; raises EOFError at the end of the input.

    Raises:
        Quit: the player wants no more.
    """
    played, ended = Played(), False
    _, info = env.reset(**reset)
    while not ended:
        print(f"\n{env.render()}", file=sys.stdout)
        action = _ask_action(env, program, ask)
        _, reward, terminated, truncated, info = env.step(action)
        ended = bool(terminated or truncated)
        played.actions.append(action)
        played.reward += float(reward)
        if info["utterance"] != "NA":
            for line in info["utterance"].splitlines():
                print(f"  {printable(line)}")
    played.success, played.outcome = bool(info["success"]), outcome_name(info)
    verdict = "success" if played.success else "no success"
    print(f"\n{verdict} ({played.outcome}) after {len(played.actions)} steps, reward {played.reward:.3f}")
    return played


def outcome_name(info: dict[str, Any]) -> str:
    """How an episode ended, as it is called among all ways to end (`Playable.outcomes`)."""
    from socialai_dsl.program_suite import prefixed

    return prefixed(info["member"], info["outcome"]) if "member" in info else str(info["outcome"])


def _ask_action(env: Any, program: "Playable", ask: Callable[[str], str]) -> "NDArray[np.int64]":
    while True:
        try:
            line = ask("> ").strip()
        except EOFError:
            raise Quit from None
        if line.lower() in ("quit", "q"):
            raise Quit
        if line in ("?", "help"):
            print(_choices(program))
            continue
        primitive, utterance = split_line(line, program.actions)
        try:
            action: NDArray[np.int64] = env.unwrapped.encode_action((primitive, utterance))
        except ValueError as error:
            print(f"  {printable(str(error))}")
            continue
        return action


def split_line(line: str, actions: Sequence[str]) -> tuple[str | None, str | None]:
    """Split what was typed into movement and utterance; a movement may be shortened while it is clear."""
    first, _, rest = line.partition(" ")
    meant = [action for action in actions if first and action.startswith(first.lower())]
    if first.lower() in actions:
        meant = [first.lower()]
    # A capital begins an utterance unless the whole word is a movement.
    if len(meant) == 1 and (first.islower() or first.lower() in actions):
        return meant[0], rest.strip() or None
    return None, line or None


def _choices(program: "Playable") -> str:
    return (
        f"  movements:  {', '.join(program.actions)}\n"
        f"  utterances: {', '.join(program.templates)}\n"
        f"  <noun>:     {', '.join(program.nouns)}"
    )
