"""Plays the test set with an agent and keeps what is needed to count, describe and record its episodes."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from math import lcm
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from socialai_dsl.atomic import read_json
from socialai_dsl.checking.briefing import NO_BRIEFING, Briefing
from socialai_dsl.checking.loaded import Loaded, about_of
from socialai_dsl.compilation import compile_loaded, scenarios_of
from socialai_dsl.envs.scenario_env import ScenarioEnv
from socialai_dsl.envs.told_apart import of_rooms
from socialai_dsl.episodes.film import RecordedEpisode, film
from socialai_dsl.episodes.partners import (
    Company,
    Partners,
    company,
    meant_by,
    own_seat,
    replayed_seats,
    sitting,
)
from socialai_dsl.episodes.play import AGENT, EachRoom, Observer, Rooms, Seat, play
from socialai_dsl.episodes.players import Player, make_policy
from socialai_dsl.episodes.policies import Policy
from socialai_dsl.episodes.results import Actions, EvalResult, Results, wilson_interval
from socialai_dsl.episodes.room_sets import TEST_ROOMS, RoomSet
from socialai_dsl.episodes.traces import Think, thought_of, trace_of
from socialai_dsl.errors import UnreadableError, UsageError
from socialai_dsl.evaluation.language_model import ModelEpisodes, episodes_of_models, let_models_play
from socialai_dsl.evaluation.people import play_test_episodes
from socialai_dsl.frontend import load
from socialai_dsl.llm.episode import CUT_SHORT
from socialai_dsl.program_suite import Playable, ProgramSuite, prefixed, seats_of
from socialai_dsl.runs.folder import ROOMS
from socialai_dsl.traces import Thought, Trace
from socialai_dsl.traces.document import Outcome
from socialai_dsl.traces.endings import Ending, endings_of, short_name
from socialai_dsl.traces.tracing import Answers

if TYPE_CHECKING:  # it needs Textual
    from socialai_dsl.play.game import FinishedEpisode

TOGETHER: Final = 125
"""Test episodes played together: enough to be fast, and no result depends on it."""


@dataclass(frozen=True)
class _Played:
    """Test episodes that were played, as far as playing them again needs it; see `Evaluation`."""

    scenario: str
    loaded: Loaded
    program: Playable
    player: Player
    actions: Mapping[int, list[NDArray[np.int64]]]
    trials: int
    seat: Seat
    partners: Partners
    rooms: RoomSet

    @property
    def scripts(self) -> list[Seat]:
        """The seats that followed their scripts by themselves."""
        seats = seats_of(self.program)
        return [seat for seat in seats if seat != AGENT and self.partners.get(seat, self.player).is_script]

    @property
    def own(self) -> Seat:
        """The seat from which an episode is seen."""
        return AGENT if self.seat in self.scripts else self.seat

    def replayed(self, number: int) -> tuple[dict[Seat, Any] | None, list[NDArray[np.int64]]]:
        """Who fills the other seats when an episode is played again, and the own actions.

        It is seen from the player's seat; where nobody sat there, but its script played by itself, from the agent's.
        """
        seats, scripts = seats_of(self.program), self.scripts
        others, actions = replayed_seats(seats, self.own, scripts, self.actions[number])
        return ({} if others is None and len(seats) > 1 else others), actions

    def traces(
        self,
        numbers: Sequence[int],
        texts: Mapping[str, str],
        replies: Mapping[int, Sequence[Answers]] = MappingProxyType({}),
        cut_short: Mapping[int, str] = MappingProxyType({}),
    ) -> list[Trace]:
        """See `Evaluation.traces`.

        Args:
            numbers: of the episodes.
            texts: ending -> what the scenario says of it.
            replies: see `Evaluation`.
            cut_short: the endings of the episodes that no step ended.
        """
        # In later trials an agent remembers more than its episode, so what it makes of that one is not known.
        thinks = self.player.is_trained and self.trials == 1
        found = []
        for number in numbers:
            seats, own = self.replayed(number)
            env = ScenarioEnv(self.program, scenarios=scenarios_of(self.loaded), seats=seats)
            playing = dict.fromkeys(seats or {}, self.player) | dict(self.partners)
            try:
                policy = make_policy(self.player, env)[0] if thinks else None
                found.append(
                    trace_of(
                        env,
                        own,
                        self.rooms.reset(number),
                        scenario=self.scenario,
                        agent=self.partners.get(env.seat_names[0], self.player).agent,
                        episode=self.rooms.title(number),
                        endings=texts,
                        about=about_of(self.loaded),
                        think=None if policy is None else _thinking(policy, number),
                        replies=replies.get(number, ()),
                        cut_short=_outcome(cut_short.get(number), texts),
                        players=sitting(self.program, playing, env.seat_names[0]),
                    )
                )
            finally:
                env.close()
        return found


def _outcome(ending: str | None, texts: Mapping[str, str]) -> Outcome | None:
    return None if ending is None else Outcome(name=ending, success=False, text=texts[ending])


def _thinking(policy: Any, number: int) -> Think:
    """Asks a trained agent what it makes of each observation of an episode."""
    policy.reset(np.ones(1, np.bool_), np.array([number]))

    def think(observation: Any) -> Thought | None:
        policy.act({name: value[None] for name, value in observation.items()})
        return thought_of(policy)

    return think


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Test episodes that an agent played, with their results.

    Attributes:
        scenario: as it was asked for. loaded: the same. program: the scenario's.
        player: who played.
        result: what came of it.
        endings: in the order of the program's outcomes.
        actions: of each episode, int64 (heads,) each.
        warnings: what the agent's checkpoint does not know of this scenario, and the like.
        more: figures that count for this agent alone.
        replies: of language models, what they answered before each action of each episode.
        folder: where it is kept, if it is. kept: the name that the scenario has there.
        trials: how many episodes in a row the player remembered.
        briefing: what the player was told of the task.
        seat: the one that the player had, whose success and reward the results are.
        partners: who sat on other seats; the player itself on those that are left.
        rooms: those that were played.
    """

    scenario: str
    loaded: Loaded
    program: Playable
    player: Player
    result: EvalResult
    endings: Sequence[Ending]
    actions: Mapping[int, list[NDArray[np.int64]]]
    warnings: Sequence[str] = field(default_factory=tuple)
    more: Mapping[str, Any] = field(default_factory=dict)
    replies: Mapping[int, Sequence[Answers]] = field(default_factory=dict)
    folder: Path | None = None
    kept: str | None = None
    trials: int = 1
    briefing: Briefing = NO_BRIEFING
    seat: Seat = AGENT
    partners: Partners = field(default_factory=dict)
    rooms: RoomSet = TEST_ROOMS

    @property
    def granted(self) -> dict[str, Any]:
        """What the player was told and saw, and how much of it it kept, as results record it.

        `feedback` says whether it was told the `outcome` of an episode before the next one, `history` how many
        observations a request to a language model has, None: all of the episode or session.
        """
        is_told = self.player.is_person or (self.player.is_model and self.trials > 1)
        options = self.player.options if self.player.is_model else None
        return {
            **self.briefing.record(),
            "view": self.player.view,
            "feedback": "outcome" if is_told else "none",
            "history": None if options is None else options.history,
        }

    def figures(self) -> dict[str, Any]:
        """The figures as a JSON-able object."""
        result = self.result
        shares = result.outcomes
        figures: dict[str, Any] = {
            "episodes": result.episodes,
            "rooms": self.rooms.name,
            "success_rate": result.success_rate,
            "success_rate_se": result.success_rate_se,
            "success_interval": list(result.success_interval),
            "mean_length": result.mean_length,
            "mean_return": result.mean_return,
            "actions": self.player.manner,
            "outcomes": shares,
            "endings": [ending.figures(shares[ending.name], result.episodes) for ending in self.endings],
            "rules": dict(result.rules),
        }
        if result.session > 1:
            figures["session"] = result.session
        if self.trials > 1:
            figures["trials"] = [
                _some_of(won, played, wilson_interval(won, played))
                for won, played in result.by_trial(self.trials)
            ]
        if result.others:
            figures["seats"] = {
                seat: _some_of(int(won.sum()), len(won), result.interval(won))
                for seat, (won, _) in result.others.items()
            }
        figures |= {**_by_member(self.program, shares), **self.more}
        apart = of_rooms(self.loaded, self.program, self.rooms.reset, result.episodes)
        for (draw, value), numbers in apart.items():
            success = result.success[numbers]
            some = _some_of(int(success.sum()), len(success), result.interval(success, np.asarray(numbers)))
            figures.setdefault("results_by", {}).setdefault(draw, {})[value] = some
        if self.player.is_script:
            # A room that the script does not solve is worth looking at: it can be played again by its number.
            figures["unsolved"] = (~result.success).nonzero()[0].tolist()
        return figures

    def pick(self, success: bool, count: int) -> list[int]:
        """Numbers of up to `count` episodes that succeeded, or failed: each way of ending has its turn."""
        queues = [
            ((self.result.outcome == i) & (self.result.success == success)).nonzero()[0].tolist()
            for i in range(len(self.result.names))
        ]
        queues.sort(key=len, reverse=True)
        rounds = [queue[turn] for turn in range(count) for queue in queues if turn < len(queue)]
        return sorted(rounds[:count])

    def is_cut_short(self, number: int) -> bool:
        """Whether something else than a step ended the episode, such as an answer without an action."""
        return self.result.names[self.result.outcome[number]] in CUT_SHORT

    def record(self, number: int, label: str) -> RecordedEpisode:
        """Play one of the episodes once more, for people to look at.

        Args:
            number: of the test episode.
            label: how the recording calls the agent.
        """
        seats, own = self._episodes.replayed(number)
        env = ScenarioEnv(self.program, "rgb_array", scenarios_of(self.loaded), seats)
        title = f"{short_name(self.scenario)}, {self.rooms.title(number)}, {short_name(label)}"
        endings = {ending.name: ending for ending in self.endings}
        try:
            return film(env, own, self.rooms.reset(number), title, endings)
        finally:
            env.close()

    def to_replay(self, count: int) -> list[int]:
        """Numbers of up to `count` successes and as many failures."""
        return [number for success in (True, False) for number in self.pick(success, count)]

    def traces(self, numbers: Iterable[int]) -> list[Trace]:
        """Play these test episodes once more, and trace each with what the agent made of it, or answered."""
        chosen = list(numbers)
        cut_short = {n: self.result.names[self.result.outcome[n]] for n in chosen if self.is_cut_short(n)}
        texts = {one.name: one.text for one in self.endings}
        return self._episodes.traces(chosen, texts, self.replies, cut_short)

    @property
    def scripts(self) -> list[Seat]:
        """The seats that followed their scripts by themselves, and have no actions of their own."""
        return self._episodes.scripts

    @property
    def own(self) -> Seat:
        """The seat from which episodes are seen again: the player's, or the agent's where its script played."""
        return self._episodes.own

    @property
    def _episodes(self) -> _Played:
        own, partners = self.seat, self.partners
        return _Played(
            self.scenario,
            self.loaded,
            self.program,
            self.player,
            self.actions,
            self.trials,
            own,
            partners,
            self.rooms,
        )


def play_test_set(
    player: Player,
    scenario: str,
    loaded: Loaded,
    program: Playable,
    episodes: int,
    trials: int | None = None,
    partners: Partners = MappingProxyType({}),
    observers: Sequence[Observer] = (),
    room_set: RoomSet = TEST_ROOMS,
) -> Evaluation:
    """Play rooms 0 to `episodes - 1` of the test set, or of other rooms, of a scenario.

    Args:
        player: who plays, and how.
        scenario: as it was asked for.
        loaded: the same.
        program: the same, compiled.
        episodes: how many.
        trials: how many in a row the player remembers; by default those of a session of the scenario.
        partners: who sits on other seats than the player. On those that are left it plays as well, a person, a
            language model or a rival on the first of them alone.
        observers: watch as well, where neither a person nor a language model plays.
        room_set: the rooms.

    Raises:
        UsageError: the checkpoint or the script does not fit the scenario, or a language model does not answer.
        RunFailed: a language model has spent its budget.
    """
    endings, briefing = endings_of(loaded, program), player.briefing(loaded)
    own, trials = own_seat(partners, program), trials or program.session
    if player.is_person:
        person = play_test_episodes(player, partners, scenario, loaded, program, episodes, briefing, room_set)
        found = _of_person(person, scenario, loaded, program, player, own, partners, briefing)
        return replace(found, rooms=room_set)
    if player.is_model or player.rival is not None:  # which play on one seat alone
        partners = _with_idle(partners, own, program)
    if models := [one for one in (player, *partners.values()) if one.is_model]:
        players = {seat: partners.get(seat, player) for seat in seats_of(program)}
        place = models[0].kept_in
        played = let_models_play(players, own, scenario, loaded, program, episodes, place, trials, room_set)
        found = _of_models(played, scenario, loaded, program, player, partners, briefing)
        alike = replace(found.result, session=_alike(player, program, trials))
        return replace(found, result=alike, trials=trials, rooms=room_set)
    kept = Actions()
    with _playing(player, partners, scenario, loaded, program, -(-episodes // trials)) as playing:
        session = _alike(player, program, trials)
        result = _result_of(playing, episodes, session, [kept, *observers], trials, room_set)
    told = playing.told
    found = Evaluation(scenario, loaded, program, player, result, endings, kept.played, told)
    return replace(found, trials=trials, seat=own, partners=partners, rooms=room_set)


def trace_test_episodes(
    player: Player,
    scenario: str,
    loaded: Loaded,
    program: Playable,
    numbers: Sequence[int],
    trials: int = 1,
    partners: Partners = MappingProxyType({}),
    room_set: RoomSet = TEST_ROOMS,
) -> tuple[list[Trace], list[str]]:
    """Trace some test episodes as `play_test_set` plays them, without playing those before.

    What `random` or a network draws depends on its seed and on the number of the first episode of its session, and its
    memory begins there. So the sessions with these episodes are played, from their first to their last episode.

    Args:
        player: who plays: the script, `random` or a network, of which this holds.
        scenario: as it was asked for.
        loaded: the same.
        program: the same, compiled.
        numbers: of the episodes.
        trials: how many in a row the player remembers.
        partners: see `play_test_set`.
        room_set: see `play_test_set`.

    Returns:
        The traces, and what is to be known about the player.

    Raises:
        UsageError: see `play_test_set`.
    """
    sessions = sorted({number - number % trials for number in numbers})
    kept = Actions()
    with _playing(player, partners, scenario, loaded, program, len(sessions)) as playing:
        rooms = Rooms(playing.envs, [kept], playing.own, playing.scripts)
        play(rooms, playing.policies, EachRoom(sessions[-1] + trials, trials, iter(sessions), room_set))
    texts = {one.name: one.text for one in endings_of(loaded, program)}
    played = _Played(scenario, loaded, program, player, kept.played, trials, playing.own, partners, room_set)
    return played.traces(numbers, texts), playing.told


def _with_idle(partners: Partners, own: Seat, program: Playable) -> Partners:
    """Who has all seats but the own one, where nobody was named their scripts."""
    return {seat: partners.get(seat) or meant_by(word) for seat, word in sitting(program, {}, own).items()}


def _playing(
    player: Player, partners: Partners, scenario: str, loaded: Loaded, program: Playable, sessions: int
) -> AbstractContextManager[Company]:
    """Rooms for this number of sessions, at most `TOGETHER` at once, with a player and its partners."""
    players = {seat: partners.get(seat, player) for seat in seats_of(program)}
    own = own_seat(partners, program)
    return company(players, own, scenario, loaded, program, min(TOGETHER, sessions))


def rooms_of(folder: Path) -> RoomSet:
    """The rooms that were played in the folder of an evaluation.

    Raises:
        UnreadableError: the file that says so is damaged.
    """
    try:
        kept = read_json(folder / ROOMS)
        return RoomSet(kept["name"], kept["seed"], kept["layouts"])
    except FileNotFoundError:
        return TEST_ROOMS
    except KeyError as error:
        raise UnreadableError(f"{folder / ROOMS}: lacks {error}, expected which rooms were played") from None


def evaluation_of_model(run: Path, agent: str, scenario: str, most: int) -> Evaluation:
    """The first test episodes that a language model has played, as the folder `run` of its evaluation keeps them.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: the folder holds no episodes of this scenario.
    """
    loaded = load(scenario)
    program = compile_loaded(loaded)
    rooms = rooms_of(run)
    kept = episodes_of_models(run, program, rooms, most)
    partners = {seat: meant_by(word) for seat, word in kept.players.items() if seat != kept.own}
    found = _of_models(kept, scenario, loaded, program, Player(agent, out=run), partners)
    return replace(found, rooms=rooms)


def _of_models(
    played: ModelEpisodes,
    scenario: str,
    loaded: Loaded,
    program: Playable,
    player: Player,
    partners: Partners,
    briefing: Briefing = NO_BRIEFING,
) -> Evaluation:
    return Evaluation(
        scenario,
        loaded,
        program,
        player,
        played.result,
        [*endings_of(loaded, program), *played.endings],
        played.actions,
        more=played.figures,
        replies=played.replies,
        briefing=briefing,
        seat=played.own,
        partners=partners,
    )


def evaluate_policy(
    policy: Policy | Mapping[str, Policy],
    envs: Any,
    episodes: int = 500,
    observers: Sequence[Observer] = (),
    trials: int = 1,
) -> EvalResult:
    """Play test episodes 0 to `episodes - 1`, each exactly once.

    An environment whose episode has ended plays the next one that is left. The rooms are the same for every policy, and
    the policy is told the number of each episode, so the result does not depend on the number of environments.

    Args:
        policy: the player, of several seats one for each; whether it samples, and with which seed, is its own affair.
        envs: a vector environment with `autoreset_mode="Disabled"`, which plays and counts the test episodes alone.
        episodes: N, at least the number of games; the common test set has 500.
        observers: watch as well.
        trials: how many episodes in a row the policy remembers; it is reset before each session of that many.

    Raises:
        ValueError: `episodes` is less than 1 or than the number of environments, or these reset themselves; or the
            policy's actions are not the scenario's.
    """
    players = policy if isinstance(policy, Mapping) else {AGENT: policy}
    if episodes >= 1 and (not 1 <= trials <= episodes or episodes % trials):
        raise ValueError(f"trials: got {trials}, expected a divisor of the {episodes} episodes")
    session = lcm(envs.program.session, trials)
    return _result_of(Company(envs, players, envs.seat_names[0]), episodes, session, observers, trials)


def _alike(player: Player, program: Playable, trials: int) -> int:
    """How many episodes in a row may be alike, see `EvalResult.session`."""
    return lcm(program.session, trials if player.kind in ("network", "model", "policy") else 1)


def _result_of(
    playing: Company,
    episodes: int,
    session: int,
    observers: Sequence[Observer] = (),
    trials: int = 1,
    room_set: RoomSet = TEST_ROOMS,
) -> EvalResult:
    """See `evaluate_policy`; `session`: see `EvalResult`."""
    if episodes < 1:
        raise ValueError(f"episodes: got {episodes}, expected at least 1")
    envs = playing.envs
    results = Results(envs.program.outcomes, episodes)
    before = envs.counters()["rules"]
    rooms = Rooms(envs, [results, *observers], playing.own, playing.scripts)
    play(rooms, playing.policies, EachRoom(episodes, trials, rooms=room_set))
    fired = {name: (n - before.get(name, 0)) / episodes for name, n in envs.counters()["rules"].items()}
    return results.result(fired, session)


def evaluation_of_person(run: Path, scenario: str, most: int) -> Evaluation:
    """The first test episodes that a person has played, as the journal in the folder `run` keeps them.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: the folder holds no episode of this scenario that was played to its end.
    """
    from socialai_dsl.play.game import finished_episodes
    from socialai_dsl.play.journal import FILE, read_journal

    loaded = load(scenario)
    program = compile_loaded(loaded)
    try:
        about, played = read_journal(run / FILE)[0], finished_episodes(run / FILE)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(f"{run}: holds no session of a person ({error})") from None
    if about.get("program_sha256") != program.sha256:
        raise UsageError(f"{run} holds episodes of another version of the scenario")
    partners = {seat: meant_by(word) for seat, word in about.get("seats", {}).items()}
    player, own = Player("human", out=run.parent), about.get("seat", AGENT)
    found = _of_person(played[:most], scenario, loaded, program, player, own, partners)
    return replace(found, rooms=rooms_of(run))


def _of_person(
    played: "Sequence[FinishedEpisode]",
    scenario: str,
    loaded: Loaded,
    program: Playable,
    player: Player,
    own: Seat,
    partners: Partners,
    briefing: Briefing = NO_BRIEFING,
) -> Evaluation:
    if not played:
        raise UsageError("no episode was played to its end")
    names = tuple(program.outcomes)
    result = EvalResult(
        np.array([p.ended.success for p in played]),
        np.array([names.index(p.ended.outcome) for p in played]),
        np.array([len(p.actions) for p in played]),
        np.array([p.reward for p in played]),
        names,
        session=program.session,
    )
    actions = {number: _of_all_seats(p, own, program) for number, p in enumerate(played)}
    endings = endings_of(loaded, program)
    # A person remembers every episode of the session.
    found = Evaluation(scenario, loaded, program, player, result, endings, actions, trials=len(played))
    return replace(found, briefing=briefing, seat=own, partners=_with_idle(partners, own, program))


def _of_all_seats(played: "FinishedEpisode", own: Seat, program: Playable) -> list[NDArray[np.int64]]:
    """What was done on all seats in each step, int64 (S, heads); of one seat the actions themselves."""
    seats = seats_of(program)
    if len(seats) == 1:
        return played.actions
    done = {own: played.actions, **played.others}
    nothing = np.zeros_like(played.actions[0])
    nothing[0] = len(program.actions)
    still = [nothing] * len(played.actions)
    return [np.stack(step) for step in zip(*(done.get(seat, still) for seat in seats), strict=True)]


def _some_of(successes: int, episodes: int, interval: tuple[float, float]) -> dict[str, Any]:
    """What came of some of the episodes: of one trial, or with one value of a draw."""
    return {"episodes": episodes, "success_rate": successes / episodes, "success_interval": list(interval)}


def _by_member(program: Playable, shares: Mapping[str, float]) -> dict[str, Any]:
    """Of a suite: how often each member was played, and how often with success; nothing for a scenario."""
    if not isinstance(program, ProgramSuite):
        return {}
    successes = {outcome.name for outcome in program.outcome_table if outcome.success}
    members = {}
    for member, own in zip(program.members, program.programs, strict=True):
        names = {prefixed(member, name) for name in own.outcomes}
        share = sum(shares[name] for name in names)
        won = sum(shares[name] for name in names & successes)
        members[member] = {"share": share, "success_rate": won / share if share else None}
    return {"members": members}
