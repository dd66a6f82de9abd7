"""Records one episode for people: a film with its dialogue, and a transcript."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from socialai_dsl.diagnostics import printable
from socialai_dsl.episodes.play import Observer, OneEpisode, Rooms, play
from socialai_dsl.episodes.play import Step as RoomStep
from socialai_dsl.episodes.policies import ReplayedPolicy
from socialai_dsl.program_suite import outcome_name
from socialai_dsl.render.panel import DialogueLine, Face, compose_frame
from socialai_dsl.traces.endings import Ending
from socialai_dsl.traces.steps import Step, describe_step

_STEP_MILLISECONDS: Final = 450
_END_MILLISECONDS: Final = 2500
_PALETTE_COLOURS: Final = 160
_ENDING_WIDTH: Final = 52


@dataclass
class RecordedEpisode:
    """A recorded episode.

    Attributes:
        title: what was recorded.
        steps: in order.
        frames: a picture after the reset and one after each step, uint8 (H, W, 3).
        outcome: how it ended, by name.
        ending: the same as the scenario's file says it, and where; None if that is not known.
        success: whether that counts as success.
        reward: sum of the rewards.
    """

    title: str
    steps: list[Step] = field(default_factory=list)
    frames: list[NDArray[np.uint8]] = field(default_factory=list)
    outcome: str = ""
    ending: Ending | None = None
    success: bool = False
    reward: float = 0.0

    def transcript(self) -> str:
        """The episode as text: a line for each step, what was heard under it, and how it ended.

        Four and more equal steps without a word are one line: `(until step 100)`.
        """
        lines = [self.title, "", "step  did       said and heard"]
        for _, equal in groupby(self.steps, lambda step: (step.action, step.said, step.heard)):
            steps = list(equal)
            silent = steps[0].said is None and not steps[0].heard
            if silent and len(steps) >= 4:
                lines.append(f"{steps[0].t:>4}  {steps[0].action:<8}   (until step {steps[-1].t})")
                continue
            for step in steps:
                said = f'   You: "{step.said}"' if step.said is not None else ""
                lines.append(f"{step.t:>4}  {step.action:<8}{said}".rstrip())
                lines += [f"{'':17}{printable(line)}" for line in step.heard]
        verdict = "success" if self.success else "no success"
        lines += ["", f"{verdict} ({self.outcome}) after {len(self.steps)} steps, reward {self.reward:.3f}"]
        if self.ending is not None:
            lines.append(f"{printable(self.ending.text)}   {self.ending.place}".rstrip())
        return "\n".join(lines) + "\n"

    def save_film(self, path: Path) -> None:
        """Write the frames as a GIF that loops; the last one stays longer."""
        sample = np.concatenate([self.frames[0], self.frames[len(self.frames) // 2], self.frames[-1]])
        palette = Image.fromarray(sample).quantize(_PALETTE_COLOURS)
        images = [
            Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
            for frame in self.frames
        ]
        durations = [_STEP_MILLISECONDS] * (len(images) - 1) + [_END_MILLISECONDS]
        images[0].save(
            path, save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=True
        )


def film(
    env: Any,
    actions: Sequence[NDArray[np.int64]],
    reset: Mapping[str, Any],
    title: str,
    endings: Mapping[str, Ending] | None = None,
) -> RecordedEpisode:
    """Play one episode with given actions and record it.

    Args:
        env: a single environment with render mode `rgb_array`.
        actions: int64 (heads,) each; the last one ends the episode.
        reset: arguments of `env.reset`.
        title: first line of the transcript; of a suite the member that is played is added.
        endings: what the scenario's file says of each outcome, by name.
    """
    filming = _Filming(title, endings or {})
    rooms = Rooms(env, [filming])
    play(rooms, {rooms.own: ReplayedPolicy(actions)}, OneEpisode(reset))
    assert not rooms.running.any(), f"internal: played again, {title} goes on after {len(actions)} steps"
    return filming.episode


class _Filming(Observer):
    """Takes a picture after the reset and after each step."""

    def __init__(self, title: str, endings: Mapping[str, Ending]) -> None:
        self.episode = RecordedEpisode(title)
        self._endings = endings
        self._dialogue: list[DialogueLine] = []
        self._cast: Sequence[Face] = ()

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        if "member" in rooms.info:
            self.episode.title += f": {rooms.info['member']}"
        self._cast = rooms.env.cast()
        self._add(rooms, ["before the first step", ""])

    def stepped(self, rooms: Rooms, step: RoomStep) -> None:
        """See `Observer.stepped`."""
        episode, ended = self.episode, bool(step.ended[0])
        words = describe_step(
            rooms.env.program, step.actions[rooms.own][0], len(episode.frames), step.info["utterance"]
        )
        episode.steps.append(words)
        episode.reward += float(step.reward[0])
        self._dialogue += words.dialogue
        if ended:
            episode.outcome, episode.success = str(step.info["outcome"]), bool(step.success[0])
            episode.ending = self._endings.get(outcome_name(step.info))
        self._add(rooms, _caption(episode, words, ended), words.t)

    def _add(self, rooms: Rooms, caption: list[str], now: int | None = None) -> None:
        picture = rooms.env.render()
        self.episode.frames.append(compose_frame(picture, self._dialogue, caption, now=now, cast=self._cast))


def _caption(episode: RecordedEpisode, step: Step, ended: bool) -> list[str]:
    lines = [f"step {step.t}   {step.action}"]
    if ended:
        verdict = "success" if episode.success else "no success"
        how = episode.outcome if episode.ending is None else episode.ending.short(_ENDING_WIDTH)
        lines.append(f"{verdict} ({how}), reward {episode.reward:.3f}")
    else:
        lines.append("")
    return lines
