"""One run from its beginning to its end: trains an agent if it is to be trained, tests it, and writes its folder."""

from __future__ import annotations

import contextlib
import shutil
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import harmonic_mean
from typing import TYPE_CHECKING, Any, Final

from socialai_dsl.atomic import write_json
from socialai_dsl.checking.loaded import Loaded
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.envs.factory import compiled, make_vec
from socialai_dsl.envs.seats import SCRIPT
from socialai_dsl.envs.vector_env import ScenarioVectorEnv
from socialai_dsl.episodes.partners import called, pools_of, seats_with
from socialai_dsl.episodes.play import AGENT, Seat
from socialai_dsl.episodes.players import Player, named_agent, require_trainer
from socialai_dsl.episodes.scripts import script_of, with_script
from socialai_dsl.errors import OptionError, RunFailed, UsageError
from socialai_dsl.evaluation.test_set import play_test_set
from socialai_dsl.frontend import load
from socialai_dsl.program_suite import Playable, seats_of
from socialai_dsl.runs.copies import keep_run
from socialai_dsl.runs.evaluate import result_of
from socialai_dsl.runs.folder import (
    CHECKPOINTS,
    CONFIG,
    LOCK_FILES,
    METRICS,
    RESULT,
    Run,
    new_run_folder,
    only_writer,
    scenario_folder_name,
)
from socialai_dsl.runs.learnt import Learnt
from socialai_dsl.runs.options import continued_config, new_config
from socialai_dsl.runs.outputs import draw_curve, record_run, training_figures, write_card
from socialai_dsl.runs.stopping import Stop
from socialai_dsl.traces.endings import endings_of, short_name
from socialai_dsl.trainer.config import LEARNS, RunConfig
from socialai_dsl.trainer.files import checkpoint_files

if TYPE_CHECKING:
    from socialai_dsl.runs.tracking import WandbTracker

_REMEMBERED_UPDATES: Final = 20
_TOLD_OF_PARTNERS: Final = ("episodes", "success_rate", "success_interval")


@dataclass(frozen=True)
class Progress:
    """How far a run is. The first one comes before anything is trained, the next ones after each update.

    Attributes:
        run: its folder. program: what is played, compiled.
        frames: trained so far, earlier parts of a resumed run included.
        total: those that it will have been trained for; 0 of an agent that is not trained.
        success: share of the episodes ended in this update that succeeded; None if none ended.
        episodes: how many of the agent's own ended in this update.
        frames_per_second: of this update; 0 before the first.
        learnt: what the agent has learnt so far, in words; empty where there is nothing to say.
    """

    run: Run
    program: Playable
    frames: int
    total: int
    success: float | None = None
    episodes: int = 0
    frames_per_second: float = 0.0
    learnt: str = ""


class Pace:
    """How fast and how well the last updates of a run went, and the time that is left."""

    def __init__(self) -> None:
        self._ended: deque[tuple[float, int]] = deque(maxlen=_REMEMBERED_UPDATES)
        self._speed: deque[float] = deque(maxlen=_REMEMBERED_UPDATES)

    def note(self, progress: Progress) -> None:
        """Take note of an update."""
        if progress.success is not None:
            self._ended.append((progress.success, progress.episodes))
        self._speed.append(max(progress.frames_per_second, 1e-9))

    @property
    def speed(self) -> float:
        """Frames per second; 0 before the first update."""
        # By the mean time of a frame, not the mean speed: a slow update counts for as long as it took.
        return harmonic_mean(self._speed) if self._speed else 0.0

    @property
    def success(self) -> float | None:
        """The share of episodes that succeeded; None where none has ended."""
        episodes = sum(episodes for _, episodes in self._ended)
        return sum(share * ended for share, ended in self._ended) / episodes if episodes else None

    def seconds_left(self, progress: Progress) -> float:
        """Seconds of training that are left."""
        return max(progress.total - progress.frames, 0) / self.speed


Report = Callable[[Progress], None]
"""Told how far a run is."""


def train(
    scenario: str | Path, *, out: str | Path | None = None, progress: Report | None = None, **options: Any
) -> Run:
    """Train an agent on a scenario, test it, and leave a folder of results, as `socialai-run` does.

    The folder holds the configuration, the figures of each update, checkpoints, a copy of the scenario unless it ships,
    the result of the test set, films, transcripts, a page that replays episodes, a learning curve and a model card.
    Equal options on the same machine give runs equal to the bit. Ctrl-C ends training after the update at work, with a
    checkpoint from which `resume` goes on.

    Args:
        scenario: a path or a name, with `+variants` and `?parameters`.
        out: the folder of the run, which holds none yet (default: `runs/<scenario>/<time>-s<seed>`).
        progress: called before training and after each update; nothing is printed.
        options: of `socialai_dsl.trainer.config.RunConfig`, such as `frames=100_000`, `seed=1`, `net="paper"` or
            `lr=1e-4`; those that are left out, `frames`, `recipe`, `device` and `threads` among
            them, follow from scenario and machine.
            `seats={"helper": ["script", "runs/x"]}` names players that take turns on a seat from game to game; they
            stay as they are, and the agent learns on the seats that are left.
            With `agent="random"`, `"oracle"` or the path of a trained agent nothing is trained: that agent is tested.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: an option is unknown or out of bounds, or the folder cannot be used (a ValueError).
        RunFailed: training broke down; the last good checkpoint is in the folder.
        KeyboardInterrupt: it was interrupted; the message says how to go on.
        OSError: a file cannot be written.
    """
    spec = str(scenario)
    asked = str(options.get("agent") or LEARNS)
    agent = LEARNS if asked == LEARNS else named_agent(asked, spec)
    if agent == LEARNS:
        require_trainer("matplotlib", "tensorboard")
    elif Player(agent).is_trained:
        require_trainer()
    loaded = load(spec)
    program = compiled(loaded)
    config = _with_partners(new_config(spec, {**options, "agent": agent}, loaded), program)
    with new_run_folder(None if out is None else Path(out), config.scenario, config.seed) as folder:
        before = set(folder.iterdir())
        copied: set[Path] = set()
        try:
            try:
                config = keep_run(folder, config, loaded)
            finally:
                copied = set(folder.iterdir()) - before
            return _perform(Run(folder), config, loaded, program, False, progress)
        except (ScenarioError, UsageError, RunFailed):
            ours = {folder / name for name in (CONFIG, *LOCK_FILES)}
            # What a person or a language model has played stays.
            if config.trains or set(folder.iterdir()) <= before | copied | ours:
                _discard_unstarted(folder, copied)
            raise


def resume(folder: str | Path, *, progress: Report | None = None, **options: Any) -> Run:
    """Go on with a run that was stopped, or train one for longer, as `socialai-run --resume` does.

    The weights are those of a run that never stopped, to the bit on the same processor with as many threads. A run that
    was killed before its first checkpoint begins anew.

    Args:
        folder: of the run.
        progress: see `train`.
        options: what is to be different, such as `frames` or `threads`; none that changes what an update computes.

    Raises:
        UsageError: there is no such run, it is none that trains, or it cannot go on with these options.
        ScenarioError, RunFailed, KeyboardInterrupt, OSError: see `train`.
    """
    require_trainer("matplotlib", "tensorboard")
    run = Run(Path(folder))
    _resumable(run)  # so that no folder is made where there is none
    with only_writer(run.folder):
        config = continued_config(_resumable(run), options, run.folder)
        _refuse_less(config, run)
        loaded = load(config.played)
        # A run that was killed before its first checkpoint begins anew; one that has lost its checkpoints does not.
        left = run.last_metrics is not None or run.result is not None
        begun = left or bool(checkpoint_files(run.folder / CHECKPOINTS))
        return _perform(run, config, loaded, compiled(loaded), begun, progress)


def _with_partners(config: RunConfig, program: Playable) -> RunConfig:
    """The configuration in which players on other seats are called as they are found from anywhere.

    Raises:
        UsageError: a seat does not exist, a player is unknown, or none is left that learns.
    """
    pools = _pools(config, program)
    for seat, players in pools.items():
        for player in players:
            if player.rival is not None:
                variant = f"--seat {AGENT}=script plays it on the variant {config.scenario}+{player.rival}"
                raise OptionError("seat", f"got {player.agent!r} for {seat}, expected no rival; {variant}")
            if player.is_model or player.is_person:
                raise OptionError(
                    "seat", f"got {player.agent!r} for {seat}, expected script, random or a trained agent"
                )
    names = {seat: [called(player) for player in players] for seat, players in pools.items()}
    return config.model_copy(update={"seats": names})


def _pools(config: RunConfig, program: Playable) -> dict[Seat, list[Player]]:
    """Who takes turns on which seats while the agent learns on the others. Raises UsageError as `pools_of` does."""
    named = [(seat, name) for seat, names in config.partners.items() for name in names]
    pools = pools_of(named, config.scenario, program) if named else {}
    return {
        seat: [_player(player.agent, config, config.seed) for player in players]
        for seat, players in pools.items()
    }


def _player(agent: str, config: RunConfig, seed: int, out: Path | None = None) -> Player:
    """Somebody who plays in a run, with the code of one's own that the run may load."""
    return Player(
        agent,
        config.device,
        seed=seed,
        net=config.net,
        algorithm=config.algorithm,
        folder=config.code_folder,
        out=out,
    )


def _refuse_less(config: RunConfig, run: Run) -> None:
    """Refuse a run of fewer frames than there are already, which cannot be taken back."""
    done = run.checkpoint_frames or 0
    if config.updates * config.frames_per_update < done:
        raise OptionError(
            "frames", f"got {config.frames}, but the run has {done} already; expected at least as many"
        )


def _resumable(run: Run) -> RunConfig:
    try:
        config = run.config
    except UsageError as error:
        raise OptionError("resume", str(error)) from None
    if not config.trains:
        raise OptionError("resume", f"the agent {config.agent!r} of {run.folder} is not trained")
    if run.checkpoint_frames and run.last_metrics is None:
        raise OptionError("resume", f"{run.folder} lacks its {METRICS}; copy the folder as a whole")
    return config


def _perform(
    run: Run, config: RunConfig, loaded: Loaded, program: Playable, resumed: bool, progress: Report | None
) -> Run:
    """Train if the agent is to be trained, evaluate, write everything down."""
    folder, agent = run.folder, config.agent
    training: Mapping[str, Any] = {"frames": 0, "train_seconds": 0.0, "frames_per_second": None}
    write_json(folder / CONFIG, config.model_dump())
    report = progress or (lambda progress: None)
    total = config.updates * config.frames_per_update if config.trains else 0
    report(Progress(run, program, run.checkpoint_frames or 0, total))
    if config.trains:
        agent = str(_train(run, config, loaded, program, resumed, report))
        training = training_figures(folder)
    # What is trained differs by its training; what is not, by what it draws.
    player = _player(agent, config, 0 if config.trains else config.seed, folder)
    pools = _pools(config, program)
    asked = player, config.played, loaded, program, config.eval_episodes
    played = play_test_set(*asked, partners={seat: players[0] for seat, players in pools.items()})
    evaluation = replace(played, folder=folder, kept=config.scenario)
    for warning in evaluation.warnings:
        warnings.warn(warning, stacklevel=3)
    told = {"recipe": config.recipe, "guide": config.guide} if config.trains else {}
    result = result_of(evaluation, **told, **training)
    result |= {"agent": short_name(config.player), "seed": config.seed}  # of the training, if there was one
    if pools:
        result["partners"] = {seat: names[0] for seat, names in config.seats.items()}
        result["eval"]["with"] = dict(_with_each(asked, pools, config.seats))
    record_run(evaluation, folder, f"agent {short_name(config.player)}, seed {config.seed}")
    if config.trains:
        draw_curve(config, folder, result)
        write_card(config, loaded, folder, Path(agent), result)
    write_json(folder / RESULT, result)  # last, so that its presence means a complete run
    return run


def _train(
    run: Run, config: RunConfig, loaded: Loaded, program: Playable, resumed: bool, report: Report
) -> Path:
    """Train the agent, and return the path of the final checkpoint.

    Raises:
        UsageError: the run cannot start, or its folder cannot be written.
        RunFailed: training broke down.
        KeyboardInterrupt: with a message that says how to go on.
    """
    from socialai_dsl.trainer.errors import TrainingStopped
    from socialai_dsl.trainer.training import train

    played = _played(config, loaded)
    scenario = program if played is loaded else compiled(played)
    envs = _environments(scenario, config, _pools(config, program))
    total = config.updates * config.frames_per_update
    learnt = Learnt(loaded, endings_of(loaded, program))

    def updated(row: Mapping[str, Any]) -> None:
        figures = row["frames"], total, row["success"], row["episodes"], row["frames_per_second"]
        report(Progress(run, program, *figures, learnt.sentence(row)))

    try:
        with Stop() as stop:
            tracker = _tracker(config, run.folder)
            trained = train(config, envs, run.folder, updated, resumed, tracker, program, stop.wished)
        stop.heed()
        return trained
    except TrainingStopped as error:
        raise RunFailed(str(error)) from error
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; go on with: socialai-run --resume {run.folder}") from None
    except Exception as error:
        if (place := _place_in_own_code(config, error)) is not None:
            raise UsageError(f"{place}: {type(error).__name__}: {error}") from error
        if isinstance(error, ValueError):  # options or a checkpoint that do not fit
            raise UsageError(str(error)) from error
        raise
    finally:
        envs.close()


def _with_each(
    asked: tuple[Player, str, Loaded, Playable, int],
    pools: Mapping[Seat, Sequence[Player]],
    called: Mapping[Seat, Sequence[str]],
) -> Iterator[tuple[str, dict[str, Any]]]:
    """What came of the test set with each further player of a seat, by `SEAT=PLAYER`; on other seats are the first."""
    for seat, players in pools.items():
        for player, name in zip(players[1:], called[seat][1:], strict=True):
            sitting = {other: few[0] for other, few in pools.items()} | {seat: player}
            figures = play_test_set(*asked, partners=sitting).figures()
            yield f"{seat}={name}", {key: figures[key] for key in _TOLD_OF_PARTNERS}


def _environments(
    scenario: Playable, config: RunConfig, pools: Mapping[Seat, Sequence[Player]]
) -> ScenarioVectorEnv:
    """As many rows as the run asks for; each game has a row for each seat on which the agent learns.

    Raises:
        UsageError: the rows cannot be shared out among the games, or a player does not fit.
    """
    seats = seats_of(scenario)
    own = [seat for seat in seats if seat not in pools]
    if config.envs % len(own):
        raise OptionError(
            "envs", f"got {config.envs}, expected a multiple of the {len(own)} seats: {', '.join(own)}"
        )
    games = config.envs // len(own)
    most = max(map(len, pools.values()), default=0)
    if most > games:
        raise OptionError(
            "seat", f"got {most} players that take turns, expected at most {games}, one for each game"
        )
    seating = seats_with(pools, scenario) if pools else "all" if len(seats) > 1 else AGENT
    return make_vec(scenario, num_envs=games, copy=False, autoreset_mode="SameStep", seats=seating)


def _played(config: RunConfig, loaded: Loaded) -> Loaded:
    """What is played while training: where a script plays the agent or a guide leads, the variant with that script."""
    if SCRIPT in config.seats.get(AGENT, ()):
        return with_script(config.played, loaded).loaded
    if config.guide == "none":
        return loaded
    if config.guide == "script":
        return with_script(config.played, loaded).loaded
    scripted = script_of(config.played, loaded)
    return loaded if scripted is None else scripted.loaded


def _place_in_own_code(config: RunConfig, error: BaseException) -> str | None:
    """`file:line` where the user's network, bonus, curriculum or guide raised an error; None if none of them did."""
    files = {str(file) for file in config.own_files.values()}
    places = [
        f"{frame.filename}:{frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename in files
    ]
    return places[-1] if places else None


def _tracker(config: RunConfig, folder: Path) -> WandbTracker | None:
    """Where the figures go besides the folder, if anywhere."""
    if config.wandb is None:
        return None
    from socialai_dsl.runs.tracking import WandbTracker

    name = f"{scenario_folder_name(config.scenario)} {folder.name}"
    return WandbTracker(config.wandb, folder, config.model_dump(), name)


def _discard_unstarted(folder: Path, copied: Iterable[Path]) -> None:
    """Take back the folder of a run that could not even begin, so that the same call can be made again.

    Args:
        folder: of the run.
        copied: what was copied into it, which is removed.
    """
    checkpoints = folder / CHECKPOINTS
    if not checkpoint_files(checkpoints):
        for copy in copied:
            shutil.rmtree(copy) if copy.is_dir() else copy.unlink()
        for file in (CONFIG, *LOCK_FILES):
            (folder / file).unlink(missing_ok=True)
        for empty in (checkpoints, folder):
            with contextlib.suppress(OSError):  # it is not there, or holds files of the user's
                empty.rmdir()
