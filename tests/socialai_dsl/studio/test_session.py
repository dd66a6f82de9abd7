"""A window's game: it follows the text, steps back to any moment, and lets others play."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import socialai_dsl as sd
from socialai_dsl.checking.briefing import UNTOLD
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.envs import ScenarioEnv
from socialai_dsl.episodes.play import AGENT
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.view import LastStep
from socialai_dsl.studio.judging import judge_claims, judge_tests
from socialai_dsl.studio.messages import RefusalError, Room, Shown
from socialai_dsl.studio.session import Casting, Session
from socialai_dsl.studio.worker import Desk
from tests.socialai_dsl.studio.shy import SHY

SCENARIOS = Path(__file__).parents[3] / "scenarios"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    for name in ("talkitout", "talkitout_oracle"):
        source = SCENARIOS / f"{name}.yaml"
        if source.exists():
            shutil.copy(source, tmp_path)
    return tmp_path / "talkitout.yaml"


@pytest.fixture
def session(path: Path) -> Session:
    begun = Session()
    drawn = begun.draw(str(path), path.read_text(), Room(seed=3))
    assert drawn["findings"] == []
    return begun


def test_it_draws_what_is_written_and_not_what_is_saved(path: Path) -> None:
    drawn = Session().draw(str(path), path.read_text().replace("size: 5..8", "size: 9"))
    assert drawn["episode"]["trace"]["moments"][0]["room"] == [9, 9]


def test_mistakes_have_a_place_and_leave_no_room(path: Path) -> None:
    drawn = Session().draw(str(path), path.read_text().replace("horizon:", "horizn:"))
    assert "episode" not in drawn
    assert (drawn["findings"][0]["line"], drawn["findings"][0]["error"]) == (7, True)
    assert "horizon" in drawn["findings"][0]["message"]


def test_no_game_goes_on_in_another_file_that_has_mistakes(session: Session, path: Path) -> None:
    other = path.with_name("other.yaml")
    assert "episode" not in session.draw(str(other), "scenario: other\n")
    for ask in (session.auto, session.replay, session.layout, session.begin, lambda: session.act("forward")):
        with pytest.raises((RefusalError, ScenarioError)) as refused:
            ask()
        assert "talkitout" not in str(refused.value)
    assert "episode" in session.draw(str(other), path.read_text().replace("talkitout", "other"))


def test_what_is_seen_from_the_seat_is_what_a_model_reads(session: Session, path: Path) -> None:
    """The scenario's `about` is not told, its instructions are."""
    model = Episode(str(path), "grid")
    for told in (UNTOLD, "Ask."):
        if told == "Ask.":
            session.draw(str(path), path.read_text() + "instructions: {en: Ask., de: Frag.}\n", Room(seed=3))
        (seat,) = session.begin(Room(seed=3))["episode"]["seats"]
        assert seat["seen"] == model.reset(3)
        assert seat["told"] == f"An episode ends with success, with failure, or after 100 turns. {told}"
        assert seat["compass"]
        for movement in ("left", *["forward"] * 8, "done"):
            assert session.act(movement)["seat"]["seen"] == model.step(f"Act: {movement}").text


@pytest.mark.parametrize("name", ["talkitout", "school/boxes+pointing", "school/marbles"])
def test_a_page_finds_the_directions_of_the_observation_again(name: str) -> None:
    """In its picture directions are turned as on a screen; `observed` of the page turns them back."""
    session = Session()
    session._use(sd.load(name), Casting())
    stage, tracing = session._made()
    stage.begin({"seed": 0})
    random, looks = np.random.default_rng(0), list[list[int]]()
    for _ in range(40):
        trace = tracing.tracer.trace()
        looks, view = trace.looks, next(one.view for one in reversed(trace.moments) if one.view is not None)
        image = stage.observations[AGENT]["image"][0]
        facing, compass = trace.moments[-1].agent[2], session._seat()["compass"]
        for cell, number in enumerate(view):
            kind, _, _, drawn = looks[number]
            turned = (drawn + facing + 1) % 4 if kind == 16 or (kind == 11 and compass) else drawn
            if cell != 45:  # where the agent stands is what it carries
                assert turned == image[cell % 7, cell // 7, 3] or (kind == 11 and not compass)
        if not stage.running.all():
            break
        stage.step({AGENT: random.integers(0, stage.action_sizes, dtype=np.int64)[None]})


def test_steps_are_taken_back_with_their_chance(session: Session) -> None:
    def play() -> list[dict[str, Any]]:
        moments: list[dict[str, Any]] = []
        while not moments or ("ended" not in moments[-1] and len(moments) < 20):
            moments += session.auto()["more"]["moments"]
        return moments

    for seed in range(4):
        session.begin(Room(seed=seed), "random")
        first = play()
        assert session.back(0) == {"length": 0}
        assert play() == first


def test_the_script_plays_to_its_end_and_nothing_comes_after_it(session: Session) -> None:
    session.begin(Room(seed=3), "script")
    ended = None
    while ended is None:
        ended = session.auto()["more"]["moments"][0].get("ended")
    assert ended["success"]
    with pytest.raises(RefusalError, match="has ended"):
        session.auto()
    page = session.replay()["page"]
    assert page.startswith("<!doctype html>")


def test_a_trained_agent_that_ships_plays_to_its_end(session: Session) -> None:
    session.begin(Room(seed=3), "shipped:talkitout")
    ended, moments = None, 0
    while ended is None:
        ended, moments = session.auto()["more"]["moments"][0].get("ended"), moments + 1
    assert moments <= 100
    with pytest.raises(RefusalError, match="no agent of this name ships"):
        session.begin(Room(seed=3), "shipped:nobody")


def test_it_says_what_was_probably_meant(session: Session) -> None:
    with pytest.raises(RefusalError, match="did you mean 'How are you'"):
        session.act(line="Howw are you")
    assert session.act(line="forward How are you")["more"]["moments"][0]["said"] == "How are you"


def test_a_thing_is_put_elsewhere_and_the_layout_can_be_used(session: Session) -> None:
    before = session.layout()["layout"]
    room = before["room"]
    taken = {tuple(one["at"]) for one in before.values() if isinstance(one, dict) and "at" in one}
    free = next(
        [x, y]
        for x in range(1, room["width"] - 1)
        for y in range(1, room["height"] - 1)
        if (x, y) not in taken
    )
    placed = session.place("wizard", free)["episode"]
    assert placed["room"]["seed"] == 3, "what happens later is drawn as before"
    assert placed["trace"]["moments"][0]["state"]["wizard.at"] == free
    assert placed["trace"]["moments"][0]["state"]["let.exit"] == before["let"]["exit"]
    env = sd.make("talkitout")
    env.reset(seed=0, options={"layout": session.layout()["layout"]})
    assert env.unwrapped.describe()["wizard"]["at"] == free  # type: ignore[attr-defined]
    for who, at in (
        ("wizard", before["liar"]["at"]),
        ("wizard", [99, 0]),
        ("nobody", free),
        ("wizard[²]", free),
    ):
        with pytest.raises(RefusalError):
            session.place(who, at)
    assert session.layout()["layout"]["wizard"]["at"] == free


def test_steps_that_were_not_taken_cannot_be_taken_back(session: Session) -> None:
    with pytest.raises(RefusalError, match="there are 0 steps"):
        session.back(99)


def test_preparing_the_first_step_changes_nothing(path: Path) -> None:
    played = []
    for prepares in (False, True):
        session = Session()
        session.draw(str(path), path.read_text(), Room(seed=3))
        for player in ("me", "script", "random"):
            session.begin(Room(seed=5), player)
            if prepares:
                session.prepare()
            played.append(
                [session.act("forward"), session.act(line="How are you"), session.auto(), session.layout()]
            )
    assert played[:3] == played[3:]


def test_a_script_that_does_what_cannot_be_done_is_told_and_the_game_goes_on(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.begin(Room(seed=3), "script")
    session.auto()
    with monkeypatch.context() as patched:
        patched.setattr(ScenarioEnv, "scripted_action", lambda self: np.array([-1, 0, 0, 0]))
        for _ in range(2):
            with pytest.raises(RefusalError, match="script chose what cannot be done: step: got the action"):
                session.auto()
    assert session.auto()["more"]["moments"][0]["t"] == 2


@pytest.mark.parametrize("base", ["../secret.yaml", "link.yaml"])
def test_files_outside_of_the_folder_are_not_read(tmp_path: Path, base: str) -> None:
    (tmp_path / "secret.yaml").write_text("scenario: secret\nabstract: true\nhorizon: 3\n")
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "link.yaml").symlink_to("../secret.yaml")
    drawn = Session().draw(str(folder / "a.yaml"), f"scenario: a\nextends: {base}\n")
    assert "outside the scenario's folder" in drawn["findings"][0]["message"]


@pytest.fixture
def shy(tmp_path: Path) -> tuple[Session, str]:
    path = tmp_path / "shy.yaml"
    path.write_text("scenario: shy\n")  # what is checked and played is the text, not the file
    session = Session()
    assert "episode" in session.draw(str(path), SHY)
    return session, str(path)


def moments(shown: dict[str, Any]) -> list[dict[str, Any]]:
    episode = shown["episode"]
    found: list[dict[str, Any]] = episode["trace"]["moments"]
    assert len(episode["seats"]) == len(found)
    return found


def test_a_violated_claim_leads_to_its_room_and_its_step(
    shy: tuple[Session, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    session, path = shy
    monkeypatch.setattr("socialai_dsl.studio.judging._CHECK_SECONDS", 300.0)  # on a busy machine, too
    checked = judge_claims(path, SHY)
    never, reachable, rival, knowable = checked["claims"]
    assert [one["verdict"] for one in checked["claims"]] == ["fails", "holds", "fails", "holds"]
    assert (never["file"], never["line"], SHY.splitlines()[never["line"] - 1][:6]) == (None, 24, "check:")
    assert reachable["shown"] is None
    assert knowable["shown"] is None
    assert checked["lines"][0].endswith("shy.yaml: 100 rooms of seed 0")

    shown = Shown.model_validate(never["shown"])
    assert shown.acts
    *before, last = moments(session.show(shown))
    assert last["state"]["guide.state"] == "helped"
    assert all("helped" not in str(one.get("state")) for one in before)

    # A strategy that lacks the skill plays to the end.
    *_, last = moments(session.show(Shown.model_validate(rival["shown"])))
    assert last["ended"]["success"]
    assert session._casting == Casting("script", "+hasty")
    session.begin()
    assert session._casting == Casting()


def test_a_failing_test_leads_to_the_step_with_which_something_is_wrong(shy: tuple[Session, str]) -> None:
    session, path = shy
    failing, passing = judge_tests(path, SHY)["tests"]
    assert (passing["test"], passing["passes"], passing["shown"]) == ("gives_up", True, None)
    assert not failing["passes"]
    (finding,) = failing["findings"]
    assert (finding["code"], finding["file"]) == ("S803", None)
    assert "heard nothing" in finding["message"]
    assert failing["shown"]["acts"] == ["forward", "Where is the exit"]
    last = moments(session.show(Shown.model_validate(failing["shown"])))[-1]
    assert last["said"] == "Where is the exit"
    assert "distance(agent) is 3" in str(session._playing()[1].tracer.trace().texts)


def test_what_was_played_becomes_a_test_in_the_file_beside(shy: tuple[Session, str], tmp_path: Path) -> None:
    session, path = shy
    with pytest.raises(RefusalError, match="nothing was played yet"):
        session.write_test("told")
    session.begin(Room(seed=4, index=2))
    for line in ("forward", "forward Where is the exit"):
        session.act(line=line)
    session.act("left")
    session.back(2)
    written = session.write_test("told")
    assert written["beside"] == "shy.tests.yaml"
    assert not (tmp_path / "shy.tests.yaml").exists()
    assert written["text"] == f"tests_of: shy.yaml\ntests:\n{written['entry']}"
    assert "room: {seed: 4, index: 2}" in written["entry"]
    assert '"Ann: Go to the green door."' in written["entry"]
    with pytest.raises(RefusalError, match="has a test `told` already; choose another name"):
        session.write_test("told", written["text"])
    with pytest.raises(RefusalError, match="expected letters"):
        session.write_test("a test")
    both = session.write_test("told_again", written["text"])["text"]
    Path(path).write_text(SHY)
    tested = judge_tests(str(tmp_path / "shy.tests.yaml"), both)["tests"]
    assert [(one["test"], one["passes"]) for one in tested] == [("told", True), ("told_again", True)]


def test_beside_its_tests_a_scenario_is_played(shy: tuple[Session, str], tmp_path: Path) -> None:
    session, path = shy
    Path(path).write_text(SHY)
    beside = tmp_path / "shy.tests.yaml"
    text = "tests_of: shy.yaml\ntests:\n  waits: {play: [{do: none}], ends: open}\n"
    drawn = session.draw(str(beside), text)
    assert drawn["findings"] == []
    assert len(moments(drawn)) == 1
    assert "findings" in session.draw(str(beside), text.replace("none", "jump"))
    session.draw(str(beside), text)
    session.act("forward")
    assert "waits" in session.write_test("moves", text)["text"]


def test_mistakes_are_found_before_anything_is_played(tmp_path: Path) -> None:
    path = str(tmp_path / "shy.yaml")
    Path(path).write_text(SHY)
    for found in (judge_claims(path, "scenarioo: x\n"), judge_tests(path, "tests: {}\nscenarioo: x\n")):
        assert found["findings"][0]["code"].startswith("S")
    with pytest.raises(RefusalError, match="there are no tests yet"):
        judge_tests(path, SHY[: SHY.index("tests:")])


def test_a_mistake_in_another_file_is_told_with_its_place(tmp_path: Path) -> None:
    """As the script of a template is one once its scenario is rewritten."""
    path = tmp_path / "shy.yaml"
    path.write_text(SHY)
    script = {"cast.agent.frame": "go", "frames.go": {"steps": [{"do": "face(nobody_here)"}]}}
    (tmp_path / "shy_oracle.yaml").write_text(
        yaml.safe_dump({"variant": "shy_oracle", "of": "shy.yaml", "set": script})
    )
    (found,) = judge_claims(str(path), SHY)["findings"]
    assert (found["file"].endswith("shy_oracle.yaml"), found["code"]) == (True, "S201")
    desk = Desk(tmp_path)
    assert json.loads(desk.answer(json.dumps({"id": 1, "do": "draw", "path": "shy.yaml", "text": SHY})))
    begin = {"id": 2, "do": "begin", "room": {"seed": 0}, "player": "script", "variant": "+oracle"}
    refused = json.loads(desk.answer(json.dumps(begin)))["refused"]
    assert "shy_oracle.yaml:" in refused
    assert "S201" in refused


def test_where_a_room_cannot_be_everything_else_is_refused_until_another_begins(
    session: Session, path: Path
) -> None:
    text = path.read_text()
    drawn = session.draw(str(path), text, Room(layout={"nobody": {"at": [1, 1]}}))
    assert "nobody" in drawn["refused"]
    for ask in (
        lambda: session.act("left"),
        lambda: session.choose("left"),
        session.auto,
        lambda: session.back(0),
        lambda: session.place("wizard", (1, 1)),
        lambda: session.look("wizard"),
        lambda: session.glance("wizard"),
        session.layout,
        lambda: session.write_layout(text),
        session.replay,
        lambda: session.write_test("mine"),
    ):
        with pytest.raises(RefusalError, match="there is no room yet"):
            ask()
    session.begin(Room(seed=3))
    assert session.act("left")["more"]["moments"][0]["did"] == "left"


def test_a_layout_is_written_for_a_member_that_there_is(session: Session) -> None:
    with pytest.raises(RefusalError, match="what is played is no member of this suite"):
        session.write_layout("suite: both\nmembers: [dance, help]\n")


def test_an_episode_begins_again_where_it_began(session: Session) -> None:
    first = session.begin(Room(seed=5, index=3))["episode"]
    assert first["room"] == {"seed": 5, "index": 3}
    env = sd.make("talkitout")
    env.reset(seed=5, options={"index": 3})
    assert session.layout()["layout"]["agent"] == env.unwrapped.describe()["agent"]  # type: ignore[attr-defined]
    test_set = session.begin(Room(test_episode=17))["episode"]["trace"]
    assert test_set["episode"] == "test episode 17"
    with pytest.raises(RefusalError, match="leave out the index or the test episode"):
        session.begin(Room(test_episode=1, index=1))


def test_it_says_who_can_play(shy: tuple[Session, str], session: Session, path: Path) -> None:
    assert shy[0].draw(shy[1], SHY)["plays"] == {
        "names": ["shy"],
        "rivals": ["hasty"],
        "seats": [{"seat": "agent", "script": False}],
    }
    copied = path.with_name("talkitout_2.yaml")
    for file, names in ((path, ["talkitout"]), (copied, ["talkitout", "talkitout_2"])):
        assert session.draw(str(file), path.read_text())["plays"]["names"] == names
    assert session.draw(str(path), path.read_text())["plays"]["seats"][0]["script"]
    shy[0].begin(Room(), "script", "+hasty")
    shy[0].auto()
    with pytest.raises(RefusalError, match="has no script"):
        shy[0].begin(Room(), "script")


def test_what_a_member_of_the_cast_sees_follows_the_episode(shy: tuple[Session, str]) -> None:
    session, _ = shy
    session.begin(Room(seed=2))
    first = session.look("guide")
    assert (first["who"], first["step"], first["side"]) == ("guide", 0, 7)
    up = {7 * y + x for y in range(4) for x in range(2, 7)}
    assert set(first["cells"]) == up, "at 5, 3, looking up"
    session.act("forward")
    left = {7 * y + x for y in range(7) for x in range(6)}
    assert session.layout()["layout"]["guide"]["facing"] == "left"
    assert set(session.look("guide")["cells"]) == left
    session.back(0)
    assert session.look("guide") == first
    session.begin(Room(test_episode=3))
    assert session.look("guide")["cells"] == first["cells"]
    for nobody in ("agent", "door", "nobody", ""):
        with pytest.raises(RefusalError, match="nobody called"):
            session.look(nobody)


TOGETHER = SCENARIOS / "together"


@pytest.fixture
def levers(tmp_path: Path) -> Session:
    """Two seats, each of which sees its own side of a wall."""
    for name in ("levers_together", "levers_together_oracle"):
        shutil.copy(TOGETHER / f"{name}.yaml", tmp_path)
    path = tmp_path / "levers_together.yaml"
    session = Session()
    drawn = session.draw(str(path), path.read_text(), Room(seed=3))
    seats = [{"seat": "agent", "script": True}, {"seat": "partner", "script": True}]
    assert drawn["plays"]["seats"] == seats
    assert drawn["episode"]["others"] == {"partner": "script"}
    return session


def test_a_person_on_another_seat_gets_what_that_seat_gets(levers: Session) -> None:
    begun = levers.begin(Room(seed=3), seat="partner")["episode"]
    assert begun["others"] == {"agent": "script"}
    assert begun["trace"]["own"] == "partner"
    beside = sd.make("together/levers_together+oracle", seats={"agent": "script"}).unwrapped
    reads = TextView(beside.program, "grid")  # type: ignore[attr-defined]
    observation, info = beside.reset(seed=3)
    assert begun["seats"][0]["seen"] == reads.observe(observation, info)
    for movement in ("forward", "right", "forward", "toggle"):
        before, stepped = observation, levers.act(movement)
        observation, reward, *_, info = beside.step(beside.encode_action((movement, None)))  # type: ignore[attr-defined]
        last = LastStep(movement, before["image"])
        assert stepped["seat"]["seen"] == reads.observe(observation, info, last)
        agent, (partner,) = stepped["more"]["moments"][0], stepped["more"]["moments"][0]["seats"]
        assert agent["action"] is not None, "the trace has what all have done"
        assert (partner["did"], partner.get("reward", 0)) == (movement, reward)


@pytest.mark.parametrize("who", ["script", "random", "nobody"])
def test_the_other_seat_is_played_by_whom_one_chooses_also_after_steps_back(
    levers: Session, who: str
) -> None:
    levers.begin(Room(seed=5), others={"partner": who})

    def moments() -> list[dict[str, Any]]:
        return [levers.act("forward")["more"]["moments"][0] for _ in range(6)]

    first = moments()
    done = [moment["seats"][0]["did"] for moment in first]
    assert (set(done) == {"none"}) is (who == "nobody"), done
    levers.back(0)
    assert moments() == first
    assert levers._playing()[1].tracer.trace().players == {"partner": who}


def test_who_stands_in_for_a_person_goes_on_as_if_it_had_looked_on(levers: Session) -> None:
    """A policy that remembers is asked in every step, whoever plays, and taken back with the steps."""
    begun = levers.begin(Room(seed=5), others={"partner": "random"})["episode"]
    assert begun["others"] == {"partner": "random"}
    levers._filled, memory = {"partner": (counting := _Counting())}, counting.seen
    levers._let_sit({})
    stage, tracing = levers._playing()
    stage.env.fill_seat("partner", counting)
    for step in range(4):
        acts = {"partner": [0, 0, 0, 0]} if step in (1, 2) else {}
        moment = levers.act("forward", acts=acts)["more"]["moments"][0]
        assert (moment["seats"][0]["did"] == "left") is bool(acts), "the person turns, and nobody else does"
        assert len(memory) == step + 1
    assert tracing.tracer.trace().players == {"partner": "a person"}
    levers.begin(Room(seed=5), others={"partner": "random"})
    assert tracing.tracer.trace().players == {"partner": "random"}


class _Counting:
    """A policy that goes nowhere and remembers what it has seen."""

    def __init__(self) -> None:
        self.seen: list[Any] = []

    def reset(self, mask: Any, episodes: Any = None) -> None:
        self.seen.clear()

    def act(self, observation: Any) -> Any:
        self.seen.append(observation)
        return np.array([[4, 0, 0, 0]])


def test_everybody_is_seen_as_the_engine_has_it_whoever_plays(levers: Session) -> None:
    levers.begin(Room(seed=5), seat="partner", others={"agent": "random"})
    for _ in range(5):
        levers.act("right")
        assert levers.look("partner")["cells"]  # asserts within that it has followed the episode


def test_who_sits_where_outlives_a_change_of_the_text(levers: Session) -> None:
    path = levers._file
    levers.begin(Room(), seat="partner", others={"agent": "random"})
    drawn = levers.draw(str(path), path.read_text() + "# a change\n")["episode"]
    assert (drawn["trace"]["own"], drawn["others"]) == ("partner", {"agent": "random"})
    alone = levers.draw(str(path), path.read_text().replace(", seat: open", ""))["episode"]
    assert (alone["trace"].get("own", "agent"), alone["others"]) == ("agent", {})


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"seat": "bob"}, "there is no seat 'bob', only agent, partner"),
        ({"others": {"bob": "random"}}, "got 'bob', expected one of agent, partner"),
        ({"others": {"agent": "random"}}, "got another player for agent, whom me plays already"),
        ({"others": {"partner": "shipped:nobody"}}, "no agent of this name ships"),
    ],
)
def test_a_seating_that_cannot_be_leaves_the_game_as_it_was(
    levers: Session, asked: dict[str, Any], said: str
) -> None:
    before = levers.act("forward")["more"]["moments"][0]["t"]
    with pytest.raises(RefusalError, match=said):
        levers.begin(Room(), **asked)
    assert levers.act("left")["more"]["moments"][0]["t"] == before + 1


def test_a_test_is_made_of_what_tests_can_play(levers: Session) -> None:
    levers.act("left")
    assert "do: left" in levers.write_test("turns")["text"]
    for asked in ({"seat": "partner"}, {"others": {"partner": "random"}}):
        levers.begin(Room(), **asked)  # type: ignore[arg-type]
        levers.act("left")
        with pytest.raises(RefusalError, match="a test plays the agent beside scripts"):
            levers.write_test("turns")
