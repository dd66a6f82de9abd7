"""Records one episode for people: a film with its dialogue, and a transcript."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from socialai_dsl.diagnostics import printable
from socialai_dsl.envs.seats import SeatMoment
from socialai_dsl.episodes.play import Observer, OneEpisode, Rooms, play
from socialai_dsl.episodes.play import Step as RoomStep
from socialai_dsl.episodes.policies import ReplayedPolicy
from socialai_dsl.program_suite import Playable, outcome_name
from socialai_dsl.render.panel import DialogueLine, Face, compose_frame
from socialai_dsl.traces.endings import Ending
from socialai_dsl.traces.state import names_of
from socialai_dsl.traces.steps import Step, describe_step, spoken
from socialai_dsl.vocabulary import YOU

_STEP_MILLISECONDS: Final = 450
_END_MILLISECONDS: Final = 2500
_PALETTE_COLOURS: Final = 160
_ENDING_WIDTH: Final = 52


@dataclass
class RecordedSeat:
    """What was done on a seat.

    Attributes:
        name: by which others hear it.
        steps: in order.
        success: whether the episode was its success.
        reward: sum of its rewards.
    """

    name: str
    steps: list[Step] = field(default_factory=list)
    success: bool = False
    reward: float = 0.0


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
        seats: of several seats, the actions and the result of each.
    """

    title: str
    steps: list[Step] = field(default_factory=list)
    frames: list[NDArray[np.uint8]] = field(default_factory=list)
    outcome: str = ""
    ending: Ending | None = None
    success: bool = False
    reward: float = 0.0
    seats: dict[str, RecordedSeat] = field(default_factory=dict)

    def transcript(self) -> str:
        """The episode as text: a line for each step, what was heard under it, and how it ended.

        Four and more equal steps without a word are one line: `(until step 100)`.
        """
        if self.seats:
            return self._of_several()
        lines = [self.title, "", "step  did       said and heard"]
        for _, equal in groupby(self.steps, lambda step: (step.action, step.said, step.heard)):
            steps = list(equal)
            silent = steps[0].said is None and not steps[0].heard
            if silent and len(steps) >= 4:
                lines.append(f"{steps[0].t:>4}  {steps[0].action:<8}   (until step {steps[-1].t})")
                continue
            for step in steps:
                said = f'   {YOU}: "{step.said}"' if step.said is not None else ""
                lines.append(f"{step.t:>4}  {step.action:<8}{said}".rstrip())
                lines += [f"{'':17}{printable(line)}" for line in step.heard]
        lines += [
            "",
            f"{self._verdict(self.success)} after {len(self.steps)} steps, reward {self.reward:.3f}",
        ]
        return self._ended(lines)

    def _of_several(self) -> str:
        """The same where there are several seats: a line for each of them in each step."""
        width = max(map(len, self.seats))
        lines = [self.title, "", f"step  {'who':<{width}}  did       said and heard"]
        for number, step in enumerate(self.steps):
            done = {one.name: one.steps[number] for one in self.seats.values()}
            for seat, one in zip(self.seats, done.values(), strict=True):
                first = seat == next(iter(self.seats))
                said = f'   "{one.said}"' if one.said is not None else ""
                lines.append(f"{step.t if first else '':>4}  {seat:<{width}}  {one.action:<8}{said}".rstrip())
            others = [line for line in spoken(done) if line.speaker not in done]
            lines += [f"{'':{19 + width}}{printable(f'{line.speaker}: {line.text}')}" for line in others]
        lines += [
            "",
            *(
                f"{seat:<{width}}  {self._verdict(one.success)} after {len(self.steps)} steps, "
                f"reward {one.reward:.3f}"
                for seat, one in self.seats.items()
            ),
        ]
        return self._ended(lines)

    def _verdict(self, success: bool) -> str:
        return f"{'success' if success else 'no success'} ({self.outcome})"

    def _ended(self, lines: list[str]) -> str:
        """With what the scenario's file says of the ending."""
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
        env: a single environment with render mode `rgb_array`; made with `seats` all of them are shown.
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
        env = rooms.env
        if len(env.seats) > 1:
            names = names_of(env.scenario, env.describe())
            self.episode.seats = {seat: RecordedSeat(names[seat]) for seat in env.seats}
        if "member" in rooms.info:
            self.episode.title += f": {rooms.info['member']}"
        self._cast = rooms.env.cast()
        self._add(rooms, ["before the first step", *("" for _ in self.episode.seats or [""])])

    def stepped(self, rooms: Rooms, step: RoomStep) -> None:
        """See `Observer.stepped`."""
        episode, ended = self.episode, bool(step.ended[0])
        words = describe_step(
            rooms.env.program, step.actions[rooms.own][0], len(episode.frames), step.info["utterance"]
        )
        episode.steps.append(words)
        episode.reward += float(step.reward[0])
        for seat, recorded in episode.seats.items():
            _add_step(recorded, rooms.env.program, rooms.env.seat_moment(seat), words.t)
        done = {one.name: one.steps[-1] for one in episode.seats.values()}
        self._dialogue += spoken(done) if done else words.dialogue
        if ended:
            episode.outcome, episode.success = str(step.info["outcome"]), bool(step.success[0])
            episode.ending = self._endings.get(outcome_name(step.info))
        self._add(rooms, _caption(episode, words, ended), words.t)

    def _add(self, rooms: Rooms, caption: list[str], now: int | None = None) -> None:
        picture = rooms.env.render()
        self.episode.frames.append(compose_frame(picture, self._dialogue, caption, now=now, cast=self._cast))


def _add_step(recorded: RecordedSeat, program: Playable, moment: SeatMoment, t: int) -> None:
    """Add what was done on a seat in step t."""
    heads = 3 + len(program.sentences.slots)
    action = np.zeros(heads, np.int64) if moment.action is None else moment.action
    words = describe_step(program, action, t, moment.info["utterance"])
    recorded.steps.append(replace(words, action=moment.did or "none"))
    recorded.reward += moment.reward
    recorded.success = bool(moment.success)


def _caption(episode: RecordedEpisode, step: Step, ended: bool) -> list[str]:
    """What was done in a step, and how the episode ended."""
    how = episode.outcome if episode.ending is None else episode.ending.short(_ENDING_WIDTH)
    if not episode.seats:
        verdict = "success" if episode.success else "no success"
        lines = [f"step {step.t}   {step.action}"]
        return [*lines, f"{verdict} ({how}), reward {episode.reward:.3f}" if ended else ""]
    lines = [f"step {step.t}{f'   ended: {how}' if ended else ''}"]
    for one in episode.seats.values():
        verdict = f", {'success' if one.success else 'no success'}" if ended else ""
        lines.append(f"{one.name}: {one.steps[-1].action}, reward {one.reward:.3f}{verdict}")
    return lines
