"""The step: section by section in the order of the language reference."""

from __future__ import annotations

import copy
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.reference import bodies, chance, geometry, motion, rules, speech
from tests.reference.effects import remember, vanish
from tests.reference.evaluate import Context, NothingFoundError, evaluate, holds
from tests.reference.frames import FrameRunner, Turn
from tests.reference.picture import picture
from tests.reference.room import Setup, sizes
from tests.reference.script import Outcome, script_of
from tests.reference.settling import Settling
from tests.reference.source import Sources, Value
from tests.reference.vocabulary import Vocabulary, Words
from tests.reference.world import NO_CELL, NOTHING, Entity, Heard, Kept, Performance, World, as_list

Action = tuple[int, ...]
ATTEMPTS = 64


@dataclass
class Result:
    """What a seat perceives after a reset or a step, and how the step ended for it."""

    image: np.ndarray
    tokens: list[int]
    reward: float = 0.0
    terminated: bool = False
    truncated: bool = False
    heard: tuple[str, ...] = ()
    words: list[str] = field(default_factory=list)  # of the tokens
    outcome: int | str | None = None  # its id, else its place in `outcome`; deadly, timeout
    success: bool = False


class Reference:
    """Plays one scenario, slowly. It takes a name, a resolved scenario, its models or its plain data.

    `reset` and `step` are about the agent's seat alone, `reset_all` and `play` about all.
    `words` are the numbers of words; without them it works out itself which words the scenario has.
    """

    def __init__(self, source: Any, words: Words | None = None) -> None:
        self.scenario = script_of(source)
        self.sources = Sources(self.scenario)
        self.vocabulary = words or Vocabulary(self.scenario, self.sources)
        self.looks_back = "prev(" in repr(self.scenario)
        self.canvas = self.scenario.room.canvas or (
            max(sizes(self.scenario, self.sources, "width")),
            max(sizes(self.scenario, self.sources, "height")),
        )
        self.history: dict[str, list[list[str]]] = {}  # of each seat, the words of each line
        self.world = World(0)
        self.rooms_refused = 0
        self.deaths = 0  # in the last step

    # -- reset ---------------------------------------------------------------------------------------------

    def reset(
        self,
        seed: int = 0,
        index: int = 0,
        episode: int = 0,
        test: bool = False,
        layout: dict[str, Any] | None = None,
    ) -> Result:
        """Begins an episode; what the agent perceives."""
        return self.reset_all(seed, index, episode, test, layout)[0]

    def reset_all(
        self,
        seed: int = 0,
        index: int = 0,
        episode: int = 0,
        test: bool = False,
        layout: dict[str, Any] | None = None,
    ) -> list[Result]:
        """Draws the room until all that is required of it holds; at reset the history is empty."""
        begun, session = chance.TEST_SET if test else seed, self.scenario.session
        key = chance.episode(begun, index, episode)
        first = episode - episode % session.episodes if session else episode
        kept = frozenset(f"let.{name}" for name in session.same) if session else frozenset()
        for attempt in range(ATTEMPTS):
            self.world = self.new_world(chance.attempt(key, attempt))
            self.world.session_key, self.world.kept = chance.episode(begun, index, first), kept
            self.prepare(layout or {})
            self.world.key = key
            if self.accepted():
                break
            self.rooms_refused += 1
        else:
            raise RuntimeError(f"{self.scenario.scenario}: no room has all that is required of it")
        self.history = {seat.key: [] for seat in self.world.seats}
        return [Result(image, []) for image in self.pictures()]

    def pictures(self) -> list[np.ndarray]:
        """What each seat sees now."""
        return [picture(self.world, self.canvas, seat) for seat in self.world.seats]

    def new_world(self, key: int) -> World:
        """A world with nothing in it."""
        scenario = self.scenario
        return World(
            key,
            nouns=scenario.grammar.nouns,
            fillers=scenario.grammar.fillers,
            npcs_hidden=scenario.observe.npcs == "hidden",
            own_voice=scenario.observe.own_voice,
            seats_hidden=scenario.observe.seats == "hidden",
            overheard=scenario.overheard,
            egocentric=scenario.observe.directions == "egocentric",
            occlusion=scenario.room.occlusion,
            gestures=sum(
                "pointing" in name or name == "last_act" for name in scenario.observe.channels or ()
            ),
            hands=self.shows_hands(),
            look_names={name: look.words for name, look in scenario.looks.items()},
            tone=scenario.observe.tone,
            shown_looks={
                name: look.words
                for name, look in scenario.looks.items()
                if scenario.observe.channels is None or name in scenario.observe.channels
            },
            canvas=self.canvas,
            step_names={
                name: [entry.step.state for entry in frame.entries]
                for name, frame in scenario.frames.items()
                if frame.steps is not None
            },
        )

    def shows_hands(self) -> bool:
        """Whether the picture shows what NPCs carry: if nothing else is said, where something can be carried."""
        channels = self.scenario.observe.channels
        if channels is not None:
            return "carrying" in channels
        return len(self.scenario.cast) > 1 and any(
            group.carryable for group in self.scenario.objects.values()
        )

    def prepare(self, layout: dict[str, Any]) -> None:
        """Draws one room and settles it."""
        scenario = self.scenario
        setup = Setup(scenario, self.sources, self.world, layout)
        setup.run()
        self.world.always_audible = frozenset(n for n, m in setup.members.items() if m.audible == "always")
        for entity in self.world.entities():
            remember(entity)
        self.settling = Settling(scenario, self.sources, self.world)
        self.settling.all()
        for member in self.world.cast.values():
            frame = self.sources.frame_of(member.frame)
            if frame is not None and frame.steps is not None:
                FrameRunner(self.sources, self.world, member).skip_empty(frame)

    def accepted(self) -> bool:
        """Whether the room is as `require` wants it."""
        for number, source in enumerate(self.scenario.require):
            path = f"require[{number}]" if len(self.scenario.require) > 1 else "require"
            try:
                if not holds(self.sources.expression(path, source), Context(self.world)):
                    return False
            except NothingFoundError:
                return False
        return True

    # -- step ----------------------------------------------------------------------------------------------

    def step(self, action: Action) -> Result:
        """One step in which the agent alone is played."""
        return self.play({"agent": action})[0]

    def play(self, actions: Mapping[str, Action]) -> list[Result]:
        """One step in which these members are played, the agent one of them; the results of all seats in their order.

        An action is (primitive, speak, template, noun); the primitive after the last is none.
        """
        world = self.world
        # Step 0: what is asked of the state that the last step left, then the clock.
        self.look_back()
        self.begin_step(actions)
        players = [seat for seat in world.seats if self.is_played(seat)]
        for player in players:
            self.note(player, actions[player.key])
        # Step 1: the body actions, the agent's first. A scripted agent reads its `first` before.
        runner = FrameRunner(self.sources, world, world.agent)
        turn = runner.begin()
        runner.perform_utterance(turn)
        turn.activity.primitive(world, world.agent)  # what its frame asks for, whatever the agent does
        self.move(players, actions)
        # Links are direct consequences and part of an early picture; computed statuses are not.
        self.settling.links()
        is_early = self.scenario.observe.image == "before_npcs"
        images = self.pictures() if is_early else []
        self.settling.statuses()
        # Step 2: what counts, then what moves by itself.
        self.go_on()
        # Step 3: the agent's utterance is delivered; then a scripted agent's `then` is read, then others speak.
        if world.agent in players:
            self.utter(world.agent, actions["agent"])
        runner.end(turn)
        self.speak([player for player in players if player is not world.agent], actions)
        # Step 4: NPCs in cast order.
        for npc in world.npcs:
            self.npc_turn(npc)
        # Step 5: memories.
        for memory in world.memories.values():
            if memory.open:
                memory.entries = [*memory.entries, (world.agent.action, world.agent.pair)][-memory.size :]
        # Steps 6 and 7: the world's rules, then it settles.
        rules.run(self.scenario, self.sources, world)
        self.settling.all()
        # Step 8: who was on a deadly cell is no more; outcome, then time.
        self.deaths = self.die()
        results = self.judge()
        # Step 9: the observations.
        for seat, result, image in zip(world.seats, results, images or self.pictures(), strict=True):
            result.reward += seat.bonus / 100 + self.scenario.reward.each_step
            self.perceive(seat, result, image)
        return results

    def move(self, players: list[Entity], actions: Mapping[str, Action]) -> None:
        """The bodies of players, one after the other."""
        for player in players:
            bodies.act(self.world, player, self.primitive(actions[player.key]))

    def speak(self, players: list[Entity], actions: Mapping[str, Action]) -> None:
        """The voices of players, one after the other."""
        for player in players:
            if not player.gone:
                self.utter(player, actions[player.key])

    def is_played(self, seat: Entity) -> bool:
        """Whether somebody acts on a seat in this step: where there are several, only for who is in the room."""
        return seat.taken and not (seat.gone and len(self.world.seats) > 1)

    def perceive(self, seat: Entity, result: Result, image: np.ndarray) -> None:
        """What a seat sees and hears; beyond the length of its history the oldest whole lines are dropped."""
        history = self.history[seat.key]
        history += map(self.read, seat.lines)
        while sum(map(len, history)) > self.vocabulary.length:
            history.pop(0)
        result.image = image
        result.words = [word for line in history for word in line]
        result.tokens = self.vocabulary.tokens(result.words)
        result.heard = tuple(map(self.line, seat.lines))

    def look_back(self) -> None:
        """Keeps the state for `prev`, and which memories are open in this step."""
        world = self.world
        world.before = None
        if self.looks_back:
            world.before = copy.deepcopy(world)
        for name, member in world.cast.items():
            member.accepts = self.accepts(name)
        for name, memory in world.memories.items():
            source = self.scenario.memory[name].while_
            value = None if source is None else self.sources.expression(f"memory.{name}.while", source)
            try:
                memory.open = holds(value, Context(world))
            except NothingFoundError:
                memory.open = False

    def accepts(self, name: str) -> bool:
        """Whether a member of the cast takes in this step what it is given."""
        source = self.scenario.versions(name)[0].accepts
        if source is None:
            return True
        try:
            value = self.sources.expression(f"cast.{name}.accepts", source)
            return holds(value, Context(self.world, self.world.cast[name]))
        except NothingFoundError:
            return False

    def begin_step(self, played: Collection[str]) -> None:
        """The clock; what is true of one step only is forgotten. On some seats others sit than before."""
        self.world.t += 1
        for member in self.world.cast.values():
            member.utterance, member.filled, member.pair = None, {}, 0
            member.bumped = member.poked = False
            member.lines, member.bonus = [], 0
            if member.taken or member.key in played:
                self.forget_use(member)
            member.taken = member.key in played
            if member.seat and not member.taken and not self.takes_turns(member):
                member.action = member.last_act = "none"
            if member.taken:
                member.action, member.tone = "none", self.tone_of(member)
        for thing in self.world.things():
            thing.poked = False

    def tone_of(self, player: Entity) -> str | None:
        """The tone in which a player speaks; the agent has none."""
        return None if player is self.world.agent else player.looks.get(str(self.world.tone))

    def forget_use(self, user: Entity) -> None:
        """What somebody toggled at is toggled until his next turn."""
        for thing in self.world.things():
            thing.toggled_by = [other for other in thing.toggled_by if other is not user]

    def primitive(self, action: Action) -> str:
        """The word for the first number of an action."""
        return self.scenario.actions[action[0]] if action[0] < len(self.scenario.actions) else "none"

    def note(self, player: Entity, action: Action) -> None:
        """What a player does and says in this step is known from its start."""
        grammar = self.scenario.grammar
        _, speaks, *spoken = action
        player.action = self.primitive(action)
        if speaks:
            player.pair = 1 + grammar.pairs().index(grammar.meant(*spoken))
            player.utterance, player.filled = speech.pair(self.world, grammar, player.pair)

    def go_on(self) -> None:
        """Timers, then things that roll, in object order; then the world settles."""
        motion.count_down(self.world)
        motion.roll(self.world)
        self.settling.all()

    def utter(self, player: Entity, action: Action) -> None:
        """A player speaks who wants to."""
        if action[1]:
            grammar = self.scenario.grammar
            text, filled = speech.pair(self.world, grammar, player.pair)
            to = filled.get(grammar.to[1:-1]) if grammar.to else None
            speech.speak(self.world, player, text, filled, to, player.tone)

    def takes_turns(self, npc: Entity) -> bool:
        """Whether a member has a frame or beliefs."""
        return npc.frame is not None or any(self.sources.beliefs_of(npc))

    def npc_turn(self, npc: Entity) -> None:
        """Step 4 for one NPC: `first`, the activity, `then`; its utterance carries from where it stands after it.

        Who is played has had its body and its voice, and only what its frame brings about happens now.
        """
        if not npc.taken:
            self.forget_use(npc)
        if npc.gone:
            npc.inbox.clear()
            npc.action = npc.last_act = "none"
            return
        runner = FrameRunner(self.sources, self.world, npc)
        turn = runner.begin()
        # What `first` caused may have made it vanish; what has vanished does nothing.
        if not npc.gone:
            runner.perform_utterance(turn)
            primitive = turn.activity.primitive(self.world, npc)
            if not npc.taken:
                bodies.act(self.world, npc, primitive)
            # Nothing settles because of who takes no turn.
            if self.takes_turns(npc):
                self.settling.all()
            runner.end(turn)
        else:
            npc.inbox.clear()  # its turn has ended, so what it heard is forgotten
            npc.action = npc.last_act = "none"
        if turn.say is not None and not npc.taken:
            speech.speak(self.world, npc, turn.say, turn.filled, turn.to, turn.tone)

    def read(self, heard: Heard) -> list[str]:
        """The words of a line, after a mark of who says it where lines are marked."""
        line, mark = self.line(heard), []
        if self.scenario.observe.lines == "marked":
            hidden, name = self.scenario.observe.names == "hidden", heard.speaker.name
            mark = ["<line>" if hidden else f"<{name}>"]
            line = line if hidden else line.removeprefix(name).removeprefix(":").strip()
        return [*mark, *self.vocabulary.heard(line)]

    def line(self, heard: Heard) -> str:
        """A line as it is heard: `Name: text`, `Name to Name: text`, or the text alone where names are hidden."""
        if self.scenario.observe.names == "hidden":
            return heard.text
        # Whom the agent addresses is said by its words.
        to = f" to {heard.to.name}" if heard.to is not None and heard.speaker.sort == "npc" else ""
        return f"{heard.speaker.name}{to}: {heard.text}"

    def die(self) -> int:
        """How many of those who are played are on a deadly cell; where there are several seats, they vanish."""
        world = self.world
        dead = [s for s in world.seats if s.taken and s.cell is not None and world.deadly(s.cell)]
        if dead and len(world.seats) > 1:
            for seat in dead:
                vanish(seat)
            self.settling.all()
        return len(dead)

    def all_dead(self) -> bool:
        """Whether somebody died in this step, and nobody is left to play."""
        seats = self.world.seats
        return self.deaths > 0 and (len(seats) == 1 or all(seat.gone for seat in seats if seat.taken))

    def judge(self) -> list[Result]:
        """How the step ended for each seat: deadly before everything, the first outcome that holds, then time."""
        world, seats = self.world, self.world.seats
        if self.all_dead():
            return [ended(terminated=True, outcome="deadly") for _ in seats]
        for number, outcome in enumerate(self.scenario.outcome):
            kind = "success" if outcome.success is not None else "failure"
            value = self.sources.expression(f"outcome[{number}].{kind}", getattr(outcome, kind))
            try:
                if not holds(value, Context(world)):
                    continue
                won = [kind == "success" and self.is_for(outcome, seat) for seat in seats]
                paid = [
                    self.paid(outcome, number, seat) if wins else 0.0
                    for seat, wins in zip(seats, won, strict=True)
                ]
            except NothingFoundError:
                continue
            name = number if outcome.id is None else outcome.id
            return [
                ended(reward=reward, terminated=True, outcome=name, success=wins)
                for reward, wins in zip(paid, won, strict=True)
            ]
        if world.t >= self.scenario.horizon:
            return [ended(truncated=True, outcome="timeout") for _ in seats]
        return [ended() for _ in seats]

    def is_for(self, outcome: Outcome, seat: Entity) -> bool:
        """Whether a success is one of a seat."""
        return not outcome.for_ or self.scenario.named(seat.key, outcome.for_) is not None

    def paid(self, outcome: Outcome, number: int, seat: Entity) -> float:
        """The reward of a success for a seat: a share of what is left of it by now."""
        path, share = f"outcome[{number}].reward", outcome.reward
        if isinstance(share, dict):
            name = self.scenario.named(seat.key, share)
            path, share = f"{path}.{name}", 0 if name is None else share[name]
        per_cent = evaluate(self.sources.expression(path, share), Context(self.world))
        left = 1 - self.scenario.reward.slope * self.world.t / self.scenario.horizon
        return float(min(max(per_cent, 0), 100) / 100 * left)

    # -- questions -----------------------------------------------------------------------------------------

    def probed(self, ended: bool) -> dict[str, tuple[str, list[str], str | None]]:
        """Of each probe whose moment is now, be it the first or not: question, written answers, right answer."""
        found = {}
        for name, probe in self.scenario.probes.items():
            texts = [self.sources.text(f"probes.{name}.text", text) for text in (probe.ask, *probe.answers)]
            context = Context(self.world)
            try:
                now = ended if probe.when is None else self._probe_holds(name, "when", probe.when)
                if now:
                    right = self.sources.expression(f"probes.{name}.answer", probe.answer)
                    question, *answers = (str(evaluate(text, context)) for text in texts)
                    found[name] = question, answers, self._as_answer(right)
            except NothingFoundError:
                continue
        return found

    def _probe_holds(self, name: str, key: str, source: Any) -> bool:
        return holds(self.sources.expression(f"probes.{name}.{key}", source), Context(self.world))

    def _as_answer(self, value: Value) -> str | None:
        """A value as a text, yes or no; None if nothing is found: no, if it is a condition, else it is not asked."""
        try:
            found = evaluate(value, Context(self.world))
        except NothingFoundError:
            return None
        if found is None or found is NOTHING:
            return None
        return ("yes" if found else "no") if isinstance(found, bool) else str(found)

    def scripted_action(self) -> Action:
        """What the agent's frame would do in the next step; the state stays as it is."""
        kept = self.world, self.settling
        try:
            self.world = world = copy.deepcopy(self.world)
            self.settling = Settling(self.scenario, self.sources, world)
            self.look_back()
            self.begin_step({"agent"})
            runner = FrameRunner(self.sources, world, world.agent)
            turn: Turn = runner.begin()
            runner.perform_utterance(turn)
            primitive = turn.activity.primitive(world, world.agent)
            bodies.act(world, world.agent, primitive)
            self.settling.all()
            self.go_on()
            text = runner.end(turn)
        finally:
            self.world, self.settling = kept
        actions = list(self.scenario.actions)
        number = actions.index(primitive) if primitive in actions else len(actions)
        slots = self.scenario.grammar.fillers
        return (number, 0, 0, *(0 for _ in slots)) if text is None else (number, 1, *self.pair(text))

    def pair(self, text: str) -> tuple[int, ...]:
        """The template and the words for its slots that say a text."""
        grammar = self.scenario.grammar
        for spoken in grammar.pairs():
            if speech.canonical(grammar.utterance(*spoken)) == speech.canonical(text):
                return spoken
        raise ValueError(f"the grammar cannot say {text!r}")

    def can_reach(self, a: str, b: str) -> bool:
        """Whether one thing can get to another now; `doors[0]` names a member of a group."""
        return geometry.can_reach(self.world, self.entity(a), self.entity(b))

    def entity(self, name: str) -> Entity:
        """An entity by its name in the scenario; a let that holds one counts too."""
        name = self.world.roles.get(name, name)
        found = self.world.lets.get(name) or self.world.cast.get(name) or self.world.objects.get(name)
        found = found or self.world.groups.get(name)
        if found is None:
            group, _, number = name.rstrip("]").partition("[")
            return as_list(self.world.objects[group])[int(number)]
        return found

    def describe(self) -> dict[str, Any]:
        """The whole state in the scenario's own names, made of plain data."""
        world = self.world
        return {
            "t": world.t,
            "room": {"width": world.width, "height": world.height},
            "cast": {name: self.describe_member(member) for name, member in world.cast.items()},
            "objects": {
                name: [self.describe_object(thing) for thing in as_list(group)]
                for name, group in world.objects.items()
            },
            "let": {name: self.describe_value(value) for name, value in world.lets.items()},
            "memory": {name: self.acts(memory.entries) for name, memory in world.memories.items()},
            "state": {name: plain(value) for name, value in world.registers.items()},
            "one_of": {name: m.drawn_from for name, m in world.cast.items() if m.drawn_from is not None},
        }

    def describe_value(self, value: Any) -> Any:
        """A value as data; a sequence as its acts."""
        return self.acts(value.elements) if isinstance(value, Performance) else plain(value)

    def acts(self, elements: Any) -> list[list[str | None]]:
        """Body actions, each with the text of its utterance or None."""
        grammar = self.scenario.grammar
        return [
            [move, speech.pair(self.world, grammar, said)[0] if said else None] for move, said in elements
        ]

    def describe_member(self, member: Entity) -> dict[str, Any]:
        """A member of the cast."""
        return {
            "at": plain(member.cell),
            "looks": dict(member.looks),
            "facing": member.facing,
            "color": member.color,
            "name": member.name,
            "kind_code": member.kind_code,
            "state": self.state_name(member),
            "clock": member.clock,
            "registers": {name: plain(value) for name, value in member.registers.items()}
            | self.rounds(member),
            "believes": {name: plain(value) for name, value in member.believes.items()}
            | {f"{name}.age": age for name, age in member.ages.items()},
            "gone": member.gone,
            "was_poked": member.was_poked,
            "once": sorted(member.fired_once),
        }

    def rounds(self, member: Entity) -> dict[str, int]:
        """How many rounds of nested steps are over, where there are several: `rounds[1.2]` of steps[1].steps[2]."""
        frame = self.sources.frame_of(member.frame)
        runner = FrameRunner(self.sources, self.world, member)
        entries = [] if frame is None else [frame.entries[number] for number in runner.present(frame)]
        several = {
            address: ".".join(re.findall(r"\d+", address))
            for entry in entries
            for address, nested in entry.inside
            if runner.number_of_rounds(address, nested) > 1
        }
        return {f"rounds[{name}]": member.rounds.get(address, 0) for address, name in several.items()}

    def state_name(self, member: Entity) -> str | None:
        """The state it is in; an entry of `steps` by its name or by where it stands, `finished` after the last."""
        if not isinstance(member.state, int):
            return member.state
        names = self.world.step_names[str(member.frame)]
        if member.state == len(names):
            return "finished"
        frame = self.sources.frame_of(member.frame)
        assert frame is not None
        place = re.findall(r"\d+", frame.entries[member.state].address)
        return names[member.state] or f"step{'.'.join(place)}"

    @staticmethod
    def describe_object(thing: Entity) -> dict[str, Any]:
        """An object."""
        return {
            "at": plain(thing.cell),
            "looks": dict(thing.looks),
            "color": thing.color,
            "state": thing.status,
            "gone": thing.gone,
        }


def ended(**how: Any) -> Result:
    """How a step ended for a seat; what it perceives comes later."""
    return Result(np.empty(0, dtype=np.uint8), [], **how)


def plain(value: Any) -> Any:
    """A value as data: entities by name, cells as lists."""
    if value == NO_CELL:
        return None
    if isinstance(value, Entity):
        return value.key if value.sort != "object" or value.single else f"{value.key}[{value.index}]"
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, Kept):
        return {str(plain(key)): plain(one) for key, one in value.values.items()}
    return "none" if value is NOTHING else value
