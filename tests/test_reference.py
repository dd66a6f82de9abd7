"""The reference interpreter against facts about the scenarios that were measured elsewhere."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml

from socialai_dsl import draws
from tests.reference import Reference, chance
from tests.reference.world import Entity, inward, quadrant

DATA = Path(__file__).parent / "data"
STAY = 7
WHERE, OPEN, HOW = 0, 1, 3
SESAME, EXIT, YOU = 0, 1, 3
COLORS = ("red", "green", "blue", "purple", "yellow", "grey")


def read(name: str, **changes: object) -> dict[str, Any]:
    data = yaml.safe_load((DATA / name).read_text(encoding="utf-8"))
    return {**data, **changes}


def write(text: str) -> dict[str, Any]:
    return yaml.safe_load(text)


@pytest.fixture(scope="module")
def talk() -> Reference:
    return Reference(read("talkitout.yaml"))


def put(reference: Reference, x: int, y: int) -> None:
    reference.world.agent.cell = (x, y)


def beside(reference: Reference, entity: Entity) -> None:
    """Puts the agent next to somebody and to nobody else who could answer or stand there."""
    x, y = entity.cell  # type: ignore[misc]
    world = reference.world
    for cell in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
        if world.walkable(cell) and all(npc.cell != cell for npc in world.npcs):
            world.agent.cell = cell
            return
    pytest.skip("nobody can stand beside it in this room")


def say(reference: Reference, template: int, noun: int, primitive: int = STAY):
    return reference.step((primitive, 1, template, noun))


# A room with everybody apart, so that only one can hear the agent at a time.
APART = {
    "room": {"width": 8, "height": 8},
    "agent": {"at": [2, 1], "facing": "down"},
    "wizard": {"at": [1, 1], "facing": "down", "color": "red"},
    "honest": {"at": [6, 1], "color": "blue", "name": "John"},
    "liar": {"at": [1, 6], "color": "green", "name": "Jack"},
    "doors": [
        {"at": [3, 0], "color": "red"},
        {"at": [3, 7], "color": "green"},
        {"at": [0, 4], "color": "blue"},
        {"at": [7, 4], "color": "grey"},
    ],
    "let": {"exit": "doors[1]"},
}


class TestDraws:
    def test_both_hands_agree_on_the_contract(self):
        for seed, index, episode in ((0, 0, 0), (5, 3, 9), (2**62, 4095, 10**6), (chance.TEST_SET, 0, 499)):
            key = chance.episode(seed, index, episode)
            assert key == draws.episode_key(seed, index, episode)
            for path, step, number in (("let.exit", 0, 0), ("wizard/frames.f.let.a", 99, 7)):
                bits = draws.draw(key, draws.site(path), step, number)
                assert bits == chance.bits(key, path, step, number)
                assert draws.below(bits, 13) == chance.choose(key, path, step, number, 13)


class TestRoomOfTalkItOut:
    def test_what_is_drawn_fits_the_description(self, talk):
        sizes, fronts, walled, rooms = Counter(), 0, 0, 1000
        for seed in range(rooms):
            talk.reset(seed)
            world = talk.world
            sizes[world.width, world.height] += 1
            doors = world.objects["doors"]
            front = [inward(world, door) for door in doors]
            assert [door.cell[1] for door in doors[:2]] == [0, world.height - 1]
            assert [door.cell[0] for door in doors[2:]] == [0, world.width - 1]
            assert all(2 <= door.cell[0] <= world.width - 3 for door in doors[:2])
            assert all(2 <= door.cell[1] <= world.height - 3 for door in doors[2:])
            assert len({door.color for door in doors}) == 4
            assert not {npc.cell for npc in world.npcs} & set(front), "an NPC stands in front of a door"
            assert len({member.cell for member in world.cast.values()}) == 4
            assert {world.cast["honest"].name, world.cast["liar"].name} == {"John", "Jack"}
            assert world.cast["honest"].color != world.cast["liar"].color
            assert [world.cast[name].kind_code for name in ("wizard", "honest", "liar")] == [0, 1, 1]
            fronts += world.agent.cell in front
            walled += not talk.can_reach("agent", "exit")
        assert len(sizes) == 16
        assert max(sizes.values()) < 1.5 * rooms / 16
        assert 0.25 < fronts / rooms < 0.33, "29 % of agents start in front of a door"
        assert 0.02 < walled / rooms < 0.05, "3.4 % of exits are walled in"

    def test_agent_faces_all_ways_alike(self, talk):
        facings = Counter()
        for episode in range(200):
            talk.reset(3, 0, episode)
            facings[talk.world.agent.facing] += 1
        assert all(35 < count < 65 for count in facings.values())

    def test_same_key_same_room(self, talk):
        talk.reset(7, 2, 1)
        first = talk.describe()
        talk.reset(7, 2, 2)
        assert talk.describe() != first
        talk.reset(7, 2, 1)
        assert talk.describe() == first

    def test_layout_is_put_down(self, talk):
        talk.reset(0, layout=APART)
        told = talk.describe()
        assert told["cast"]["liar"]["at"] == [1, 6]
        assert told["cast"]["honest"]["name"] == "John"
        assert [door["color"] for door in told["objects"]["doors"]] == ["red", "green", "blue", "grey"]
        assert told["let"]["exit"] == "doors[1]"


class TestDialogue:
    def test_only_a_greeting_is_answered_at_first(self, talk):
        talk.reset(0, layout=APART)
        assert say(talk, WHERE, EXIT).heard == ()
        assert say(talk, HOW, YOU).heard == ("Gandalf: I am fine.",)
        assert say(talk, HOW, YOU).heard == ()
        assert say(talk, WHERE, EXIT).heard == ("Gandalf: Ask John.",)

    def test_introductions_are_per_npc(self, talk):
        talk.reset(0, layout=APART)
        say(talk, HOW, YOU)
        put(talk, 6, 2)
        assert say(talk, WHERE, EXIT).heard == ()
        assert say(talk, HOW, YOU).heard == ("John: I am fine.",)
        assert say(talk, WHERE, EXIT).heard == ("John: Go to the green door.",)

    def test_nobody_hears_from_afar(self, talk):
        talk.reset(0, layout=APART)
        put(talk, 4, 4)
        assert say(talk, HOW, YOU).heard == ()
        assert {member["state"] for member in talk.describe()["cast"].values()} == {"stranger", None}

    def test_wizard_names_the_honest_guide(self, talk):
        for seed in range(60):
            talk.reset(seed)
            wizard, honest = talk.world.cast["wizard"], talk.world.cast["honest"]
            beside(talk, wizard)
            say(talk, HOW, YOU)
            heard = say(talk, WHERE, EXIT).heard
            assert f"Gandalf: Ask {honest.name}." in heard

    def test_liar_never_tells_the_right_door(self, talk):
        lies = Counter()
        for seed in range(30):
            talk.reset(seed, layout={**APART, "let": {}})
            put(talk, 2, 6)
            right = talk.entity("exit").color
            say(talk, HOW, YOU)
            for _ in range(20):
                (line,) = say(talk, WHERE, EXIT).heard
                color = line.removeprefix("Jack: Go to the ").removesuffix(" door.")
                assert color in {door.color for door in talk.world.objects["doors"]} - {right}
                lies[color] += 1
        assert len(lies) == 4

    def test_liar_draws_anew_each_time(self, talk):
        talk.reset(1, layout=APART)
        put(talk, 2, 6)
        say(talk, HOW, YOU)
        assert len({say(talk, WHERE, EXIT).heard for _ in range(30)}) == 3

    def test_reply_comes_after_the_move(self, talk):
        talk.reset(0, layout={**APART, "agent": {"at": [3, 1], "facing": "left"}})
        assert say(talk, HOW, YOU, primitive=2).heard == ("Gandalf: I am fine.",)

    def test_several_answer_in_cast_order(self, talk):
        talk.reset(0, layout={**APART, "liar": {"at": [3, 1]}})
        heard = say(talk, HOW, YOU).heard
        assert heard[0].startswith("Gandalf:")
        assert len(heard) == 2


class TestEnd:
    def test_right_door_pays(self, talk):
        talk.reset(0, layout=APART)
        put(talk, 3, 6)
        result = say(talk, OPEN, SESAME)
        assert (result.terminated, result.truncated, result.outcome) == (True, False, 0)
        assert result.reward == pytest.approx(1 - 0.9 / 100)

    def test_wrong_door_does_not(self, talk):
        talk.reset(0, layout=APART)
        put(talk, 3, 1)
        result = say(talk, OPEN, SESAME)
        assert (result.terminated, result.reward, result.outcome) == (True, 0.0, 1)

    def test_away_from_doors_nothing_happens(self, talk):
        talk.reset(0, layout=APART)
        put(talk, 4, 4)
        assert not say(talk, OPEN, SESAME).terminated

    @pytest.mark.parametrize("primitive", range(8))
    def test_toggle_and_done_end_it(self, talk, primitive):
        talk.reset(0, layout={**APART, "agent": {"at": [4, 4]}})
        result = talk.step((primitive, 0, 0, 0))
        assert result.terminated == (primitive in (5, 6))
        assert result.reward == 0

    @pytest.mark.parametrize("primitive", [5, 6])
    def test_right_word_with_an_ending_action_still_pays(self, talk, primitive):
        talk.reset(0, layout=APART)
        put(talk, 3, 6)
        assert say(talk, OPEN, SESAME, primitive).reward > 0.99

    def test_time_alone_truncates(self, talk):
        talk.reset(0, layout=APART)
        results = [talk.step((STAY, 0, 0, 0)) for _ in range(100)]
        assert not any(result.terminated or result.truncated for result in results[:-1])
        assert (results[-1].terminated, results[-1].truncated, results[-1].outcome) == (
            False,
            True,
            "timeout",
        )

    def test_success_at_the_last_moment_is_no_truncation(self, talk):
        talk.reset(0, layout=APART)
        put(talk, 3, 6)
        for _ in range(99):
            talk.step((STAY, 0, 0, 0))
        result = say(talk, OPEN, SESAME)
        assert (result.terminated, result.truncated) == (True, False)
        assert result.reward == pytest.approx(0.1)


class TestPerception:
    def test_picture(self, talk):
        image = talk.reset(0, layout={**APART, "agent": {"at": [2, 3], "facing": "up"}}).image
        assert image.shape == (7, 7, 4)
        assert tuple(image[3, 6]) == (1, 0, 0, 0)
        assert tuple(image[2, 4]) == (11, 0, 0, 1), "the wizard, two ahead and one to the left"
        assert tuple(image[4, 3]) == (4, 0, 1, 0), "the closed red door"
        assert tuple(image[3, 3]) == (2, 5, 0, 0), "the wall"
        assert tuple(image[0, 0]) == (2, 5, 0, 0), "off the canvas"

    def test_beyond_a_small_room_reads_empty(self, talk):
        layout = {"room": {"width": 5, "height": 5}, "agent": {"at": [3, 3], "facing": "right"}}
        image = talk.reset(0, layout=layout).image
        assert image[3, 5, 0] in (2, 4)
        assert [tuple(image[3, j]) for j in (4, 3, 2)] == [(1, 0, 0, 0)] * 3, (
            "outside the room, on the canvas"
        )
        assert tuple(image[3, 1]) == (2, 5, 0, 0), "off the canvas"

    def test_hidden_npcs_are_silent_unseen_and_passable(self):
        hidden = Reference(read("talkitout.yaml", observe={"npcs": "hidden"}))
        shown = Reference(read("talkitout.yaml"))
        assert hidden.vocabulary.ids == shown.vocabulary.ids
        image = hidden.reset(0, layout={**APART, "agent": {"at": [2, 1], "facing": "left"}}).image
        assert tuple(image[3, 5]) == (1, 0, 0, 0)
        assert say(hidden, HOW, YOU).heard == ()
        assert hidden.describe()["cast"]["wizard"]["state"] == "acquainted", "it goes on acting"
        hidden.step((2, 0, 0, 0))
        assert hidden.world.agent.cell == (1, 1)

    def test_visible_npcs_are_in_the_way(self, talk):
        talk.reset(0, layout={**APART, "agent": {"at": [2, 1], "facing": "left"}})
        talk.step((2, 0, 0, 0))
        assert talk.world.agent.cell == (2, 1)

    def test_tokens_are_the_history(self, talk):
        assert talk.reset(0, layout=APART).tokens == []
        names = {number: word for word, number in talk.vocabulary.ids.items()}
        tokens = say(talk, HOW, YOU).tokens
        assert [names[token] for token in tokens] == ["gandalf", "i", "am", "fine"]
        tokens = say(talk, WHERE, EXIT).tokens
        assert [names[token] for token in tokens[4:]] == ["gandalf", "ask", "john"]

    def test_history_drops_whole_utterances(self, talk):
        talk.reset(0, layout=APART)
        say(talk, HOW, YOU)
        for _ in range(90):
            tokens = say(talk, WHERE, EXIT).tokens
        assert talk.vocabulary.length == 256
        assert len(tokens) == 255
        assert tokens[0] == talk.vocabulary.ids["gandalf"]

    def test_vocabulary_begins_with_the_grammar(self, talk):
        assert list(talk.vocabulary.ids.items())[:3] == [("where", 2), ("is", 3), ("open", 4)]
        assert 1 not in talk.vocabulary.ids.values()


class TestScriptedAgent:
    def test_it_solves_what_can_be_solved(self):
        data = yaml.safe_load((DATA / "talkitout.yaml").read_text(encoding="utf-8"))
        data["cast"]["agent"] = {"frame": "oracle"}
        data["frames"]["oracle"] = {
            "steps": [
                {"do": "go_next_to(wizard)"},
                {"say": "How are you"},
                {"say": "Where is the exit"},
                {"do": "go_next_to(honest)"},
                {"say": "How are you"},
                {"say": "Where is the exit"},
                {"do": "go_next_to(exit)"},
                {"say": "Open sesame"},
            ]
        }
        oracle, solved, length = Reference(data), 0, 0
        for seed in range(60):
            oracle.reset(seed)
            for _ in range(100):
                result = oracle.step(oracle.scripted_action())
                if result.terminated or result.truncated:
                    break
            assert result.outcome in (0, "timeout"), "it never says the word at a wrong door"
            solved += result.outcome == 0
            length += oracle.world.t if result.outcome == 0 else 0
        assert 54 <= solved < 60, "a few rooms cannot be solved"
        assert 12 < length / solved < 25

    def test_asking_changes_nothing(self, talk):
        talk.reset(0, layout=APART)
        before = talk.describe()
        assert talk.scripted_action() == (STAY, 0, 0, 0)
        assert talk.describe() == before


class TestCoinThief:
    def test_share_of_each_number(self):
        thief = Reference(read("cointhief.yaml"))
        wanted, rooms = Counter(), 1200
        for seed in range(rooms):
            thief.reset(seed)
            world = thief.world
            wanted[world.lets["wanted"]] += 1
            eve = world.cast["thief"]
            assert abs(eve.cell[0] - world.agent.cell[0]) + abs(eve.cell[1] - world.agent.cell[1]) == 1
            assert eve.facing == quadrant(eve.cell, world.agent.cell)
        # Measured over 20,000 rooms of the research code.
        measured = (0.032, 0.100, 0.160, 0.201, 0.226, 0.192, 0.089)
        for number, share in enumerate(measured):
            assert wanted[number] / rooms == pytest.approx(share, abs=0.03)

    def test_it_looks_to_and_fro(self):
        thief = Reference(read("cointhief.yaml"))
        thief.reset(4)
        eve, home = thief.world.cast["thief"], thief.world.lets["home"]
        glance = thief.world.lets["glance"]
        heard, looks = [], []
        for _ in range(6):
            heard += thief.step((3, 0, 0, 0)).heard
            looks.append(eve.facing)
        side = looks[0]
        assert side != home
        assert looks == [side, home] * 3
        assert heard == ["Eve: Freeze! Give me all your coins!"]
        assert glance in ("left", "right")

    def test_exact_number_pays(self):
        thief = Reference(read("cointhief.yaml"))
        for seed in range(20):
            for offset in (0, 1):
                thief.reset(seed)
                number = (thief.world.lets["wanted"] + offset) % 7
                result = thief.step((3, 1, 0, number))
                assert result.terminated
                assert (result.reward > 0) == (offset == 0)

    def test_forward_fails_even_with_the_right_number(self):
        thief = Reference(read("cointhief.yaml"))
        thief.reset(0)
        assert thief.step((2, 1, 0, thief.world.lets["wanted"])).reward == 0


TEACHER = """
scenario: teacher
horizon: 30
earshot: room
grammar: {templates: [Where is <noun>], nouns: [the exit, you]}
room: {width: 7, height: 7}
objects:
  door: {type: door, at: [3, 0], color: blue, state: locked}
  lamp: {type: switch, at: [0, 3], color: green}
  box: {type: box, at: [5, 5], color: red}
define:
  lit: lamp.pressed
  near(a, b): a.distance(b) <= 2
frames:
  show:
    slots: {lesson: object, likes: bool}
    let: {times: 0}
    define: {enough: times >= 2}
    steps:
      - {do: go_next_to(lesson)}
      - {do: use(lesson), until: lit, say: I pressed the <lesson.color> one, set: {times: times + 2}}
      - {do: stay, for: 0, say: never}
      - {do: stay, for: 2, cause: [door.unlock, door.open]}
      - {state: leaving, do: enter(door)}
      - {cause: [self.vanish, door.close, lamp.reset]}
cast:
  tom: {at: [3, 3], facing: down, color: red, frame: show, with: {lesson: lamp, likes: lit}}
  agent: {at: [5, 1], facing: up}
outcome:
  - {success: tom.gone and not door.open, reward: 50, id: left}
  - failure: agent.did(done)
"""


class TestSteps:
    def test_the_entries_follow_each_other(self):
        play = Reference(write(TEACHER))
        play.reset(0)
        tom, seen = play.world.cast["tom"], []
        for _ in range(30):
            result = play.step((STAY, 0, 0, 0))
            seen.append(
                (play.world.t, tom.cell, tom.facing, play.describe()["cast"]["tom"]["state"], result.heard)
            )
            if result.terminated:
                break
        states = [state for _, _, _, state, _ in seen]
        # right turn, forward (2, 3), forward (1, 3): beside the lamp; then toggle.
        assert [cell for _, cell, _, _, _ in seen[:4]] == [(3, 3), (2, 3), (1, 3), (1, 3)]
        assert states[:4] == [0, 0, 1, 3]
        assert seen[3][4] == ("Tom: I pressed the green one",)
        assert states[5] == "leaving"
        assert result.outcome == "left"
        assert result.reward == pytest.approx(0.5 * (1 - 0.9 * play.world.t / 30))
        assert play.world.objects["door"].status == "closed"
        assert play.world.objects["lamp"].status == "idle"
        assert tom.registers == {"times": 2}
        assert tom.gone

    def test_fulfilled_entry_takes_no_turn(self):
        play = Reference(
            write(TEACHER.replace("tom: {at: [3, 3], facing: down", "tom: {at: [1, 3], facing: left"))
        )
        play.reset(0)
        play.step((STAY, 0, 0, 0))
        assert play.world.objects["lamp"].status == "pressed"

    def test_the_agent_uses_things(self):
        play = Reference(
            write(TEACHER.replace("agent: {at: [5, 1], facing: up}", "agent: {at: [5, 4], facing: down}"))
        )
        play.reset(0)
        play.step((5, 0, 0, 0))
        assert play.world.objects["box"].status == "opened"
        play.step((2, 0, 0, 0))
        assert play.world.agent.cell == (5, 4), "a box is in the way even when opened"

    def test_an_npc_in_the_way_is_poked(self):
        play = Reference(
            write(TEACHER.replace("agent: {at: [5, 1], facing: up}", "agent: {at: [3, 2], facing: down}"))
        )
        play.reset(0)
        play.step((5, 0, 0, 0))
        assert play.describe()["cast"]["tom"]["was_poked"]


RULES = """
scenario: rules
horizon: 40
earshot: room
grammar: {templates: [Say <noun>, Stop <noun>], nouns: [1, 2, three]}
room: {size: 6, build: [{lava: column(4)}]}
frames:
  talk:
    let: {last: 0, heard_any: 0}
    start: one
    states:
      one:
        first:
          - {hears: Stop three, do: turn(left), say: Turning, goto: two}
        then:
          - {hears: Say <noun>, when: noun >= 2, set: {last: noun}, say: Got <last> then <noun>, goto_now: two}
          - {once: true, hears: any, say: Once}
          - {after: 3, chance: 0.5, say: Luck}
      two:
        then:
          - {when: last == 2, say: Not heard, set: {heard_any: 1}, goto: three}
      three: {do: choose(left | 3 * right)}
  echo:
    start: a
    states:
      a: {then: [{hears: [Turning, Once], when: speaker == ann, say: I heard <speaker.name>}]}
cast:
  ann: {at: [1, 1], facing: right, color: red, frame: talk}
  bob: {at: [1, 4], facing: right, color: red, frame: echo, earshot: 2}
  agent: {at: [3, 2], facing: right}
outcome:
  - success: ann.last == 77
"""


class TestRules:
    @pytest.fixture
    def play(self) -> Reference:
        reference = Reference(write(RULES))
        reference.reset(0)
        return reference

    def test_a_rule_computes_first_and_goes_on_in_the_new_state(self, play):
        result = play.step((STAY, 1, 0, 1))
        assert result.heard == ("Ann: Got 0 then 2",), "values are those from before; one utterance per turn"
        ann = play.world.cast["ann"]
        assert ann.registers == {"last": 2, "heard_any": 1}
        assert ann.state == "three"

    def test_a_noun_that_is_no_number_is_not_more_than_one(self, play):
        assert play.step((STAY, 1, 0, 2)).heard == ("Ann: Once",)
        assert play.step((STAY, 1, 0, 0)).heard == (), "once per episode"

    def test_first_with_its_own_do_takes_the_turn(self, play):
        assert play.step((STAY, 1, 1, 2)).heard == ("Ann: Turning",)
        assert play.world.cast["ann"].facing == "up"
        assert play.world.cast["ann"].state == "two"

    def test_earshot_is_the_speakers(self, play):
        play.step((STAY, 1, 1, 2))
        bob = play.world.cast["bob"]
        assert bob.utterance == "I heard Ann", "Ann's voice fills the room"
        assert play.world.lines == [(play.world.cast["ann"], "Turning")], "Bob's does not reach the agent"

    def test_after_and_chance(self):
        reference, spoken = Reference(write(RULES)), Counter()
        for seed in range(60):
            reference.reset(seed)
            for t in range(1, 9):
                spoken[t] += len(reference.step((STAY, 0, 0, 0)).heard)
        assert spoken[1] == spoken[2] == 0
        assert 15 < spoken[3] < 45
        assert 15 < spoken[8] < 45

    def test_choose_by_weight(self):
        reference, turns = Reference(write(RULES)), Counter()
        reference.reset(5)
        reference.step((STAY, 1, 0, 1))
        for _ in range(30):
            before = reference.world.cast["ann"].facing
            reference.step((STAY, 0, 0, 0))
            turns[before, reference.world.cast["ann"].facing] += 1
        ways = ("right", "down", "left", "up")
        rights = sum(n for (a, b), n in turns.items() if ways.index(b) == (ways.index(a) + 1) % 4)
        assert sum(turns.values()) == 30
        assert 15 <= rights < 30

    def test_lava_kills(self, play):
        result = play.step((2, 0, 0, 0))
        assert (result.terminated, result.reward, result.outcome) == (True, 0.0, "deadly")
        assert tuple(play.reset(0).image[3, 5]) == (9, 0, 0, 0)


def teacher(near: bool, poked: bool, gaze: bool, formula: str) -> Reference:
    """The introduction of DiverseExit in one file, with the preferences given."""
    data = yaml.safe_load((DATA / "introduction.yaml").read_text(encoding="utf-8"))
    data["cast"]["teacher"]["with"] = {"near": near, "after_poke": poked, "gaze": gaze, "formula": formula}
    return Reference(data)


FORMULAS = {"Where is the exit": (0, 1), "Which is the correct door": (2, 2)}


class TestDiverseExit:
    @pytest.mark.parametrize("near", [False, True])
    @pytest.mark.parametrize("poked", [False, True])
    @pytest.mark.parametrize("gaze", [False, True])
    @pytest.mark.parametrize("formula", FORMULAS)
    def test_exactly_one_way_of_introducing_oneself(self, near, poked, gaze, formula):
        play, answered = teacher(near, poked, gaze, formula), []
        # The teacher stands at (3, 3) and faces up; the agent below it is the one it turns to.
        for is_near in (False, True):
            for pokes in (False, True):
                for looks in (False, True):
                    for said in FORMULAS:
                        facing = "up" if looks else "down"
                        play.reset(0, layout={"agent": {"at": [3, 4], "facing": "up"}})
                        if pokes:
                            play.step((5, 0, 0, 0))
                        play.world.agent.cell = (3, 4 if is_near else 5)
                        play.world.agent.facing = facing
                        play.world.cast["teacher"].facing = "down"
                        play.step((STAY, 1, *FORMULAS[said]))
                        # It answers at each eye contact, but only if it was approached as it likes.
                        play.world.agent.facing = "up"
                        if play.step((STAY, 0, 0, 0)).heard == ("Toby: Go to the blue door",):
                            answered.append((is_near, pokes, looks, said))
        assert answered == [(near, poked, gaze, formula)]

    def test_it_answers_in_the_same_step(self):
        play = teacher(True, False, True, "Where is the exit")
        play.reset(0, layout={"agent": {"at": [3, 4], "facing": "up"}, "teacher": {"facing": "down"}})
        assert play.step((STAY, 1, 0, 1)).heard == ("Toby: Go to the blue door",)

    def test_only_the_first_formula_counts(self):
        play = teacher(True, False, True, "Where is the exit")
        play.reset(0, layout={"agent": {"at": [3, 4], "facing": "up"}, "teacher": {"facing": "down"}})
        assert play.step((STAY, 1, 2, 2)).heard == ()
        assert play.step((STAY, 1, 0, 1)).heard == ()
        assert play.describe()["cast"]["teacher"]["state"] == "offended"

    def test_before_npcs_the_picture_is_one_turn_late(self):
        data = yaml.safe_load((DATA / "introduction.yaml").read_text(encoding="utf-8"))
        late = Reference({**data, "observe": {"image": "before_npcs"}})
        late.reset(0, layout={"agent": {"at": [3, 4], "facing": "up"}, "teacher": {"facing": "left"}})
        assert [late.step((STAY, 0, 0, 0)).image[3, 5][3] for _ in range(3)] == [2, 1, 1]
        prompt = teacher(True, False, True, "Where is the exit")
        prompt.reset(0, layout={"agent": {"at": [3, 4], "facing": "up"}, "teacher": {"facing": "left"}})
        assert prompt.step((STAY, 0, 0, 0)).image[3, 5][3] == 1


class TestGeometry:
    @pytest.mark.parametrize(
        ("offset", "direction"),
        [
            ((1, 1), "right"),
            ((1, -1), "up"),
            ((-1, -1), "left"),
            ((-1, 1), "down"),
            ((3, 1), "right"),
            ((1, 3), "down"),
            ((-3, 2), "left"),
            ((2, -3), "up"),
        ],
    )
    def test_quadrants(self, offset, direction):
        assert quadrant((5, 5), (5 + offset[0], 5 + offset[1])) == direction
