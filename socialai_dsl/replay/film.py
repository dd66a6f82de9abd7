"""Records one episode for people: a film with its dialogue, and a transcript."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from socialai_dsl.diagnostics import printable
from socialai_dsl.program_suite import Playable, outcome_name
from socialai_dsl.render.panel import DialogueLine, Face, compose_frame
from socialai_dsl.replay.endings import Ending
from socialai_dsl.replay.steps import Step, describe_step

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


def record(
    env: Any,
    program: Playable,
    actions: Sequence[NDArray[np.int64]],
    title: str,
    reset: dict[str, Any],
    meet: Callable[[], Sequence[Face]] = tuple,
    endings: Mapping[str, Ending] | None = None,
) -> RecordedEpisode:
    """Play one episode with given actions and record it.

    Args:
        env: a single environment with render mode `rgb_array`.
        program: the scenario's, for the words of actions.
        actions: int64 (heads,) each; the last one ends the episode.
        title: first line of the transcript; of a suite the member that is played is added.
        reset: arguments of `env.reset`.
        meet: says who is in the room; asked after the reset.
        endings: what the scenario's file says of each outcome, by name.
    """
    _, info = env.reset(**reset)
    cast = meet()
    episode = RecordedEpisode(f"{title}: {info['member']}" if "member" in info else title)
    dialogue: list[DialogueLine] = []
    episode.frames.append(compose_frame(env.render(), dialogue, ["before the first step", ""], cast=cast))
    for t, action in enumerate(actions, start=1):
        _, reward, terminated, truncated, info = env.step(action)
        ended = bool(terminated or truncated)
        assert ended == (t == len(actions)), f"internal: played again, the episode ended={ended} at step {t}"
        step = describe_step(program, action, t, info["utterance"])
        episode.steps.append(step)
        episode.reward += float(reward)
        dialogue += step.dialogue
        if ended:
            episode.outcome, episode.success = str(info["outcome"]), bool(info["success"])
            episode.ending = (endings or {}).get(outcome_name(info))
        episode.frames.append(
            compose_frame(env.render(), dialogue, _caption(episode, step, ended), now=step.t, cast=cast)
        )
    return episode


def _caption(episode: RecordedEpisode, step: Step, ended: bool) -> list[str]:
    lines = [f"step {step.t}   {step.action}"]
    if ended:
        verdict = "success" if episode.success else "no success"
        how = episode.outcome if episode.ending is None else episode.ending.short(_ENDING_WIDTH)
        lines.append(f"{verdict} ({how}), reward {episode.reward:.3f}")
    else:
        lines.append("")
    return lines
