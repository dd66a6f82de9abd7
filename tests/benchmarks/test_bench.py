"""`make bench`: what is measured, and what `walk` leaves out."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import socialai_dsl
from benchmarks import engine, timing
from benchmarks.__main__ import main
from benchmarks.many_programs import different_programs
from benchmarks.mixes import Allowed, random_actions, translated, walk_actions
from benchmarks.ours import Ours
from benchmarks.report import Report, Row
from benchmarks.rule_heavy import rule_heavy_actions
from benchmarks.timing import Speed, speed_of
from socialai_dsl.program import Header

DATA = Path(__file__).parents[1] / "data"

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> str:
    """The scenario of `socialai new`, in which turning right or asking for the weather gives up."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "corridor.yaml", "corridor.yaml")
    capsys.readouterr()
    text = Path("corridor.yaml").read_text(encoding="utf-8")
    text += '  - failure: agent.said("How is the weather") or agent.action == right\n'
    Path("corridor.yaml").write_text(text, encoding="utf-8")
    return "corridor.yaml"


def test_walk_leaves_out_what_ends_the_scenario(scenario: str) -> None:
    allowed = Allowed(scenario)
    program = socialai_dsl.compile(socialai_dsl.load(scenario))
    words = [*program.actions, "none"]
    assert [words[i] for i in allowed.primitives] == ["left", "forward", "none"]
    said = {program.templates[t].replace("<noun>", program.nouns[n]) for t, n in allowed.utterances}
    assert said == {"Please open the door", "Please open the weather", "How is the door"}


def test_walk_stands_still_where_every_action_ends_the_scenario(scenario: str) -> None:
    text = Path(scenario).read_text(encoding="utf-8")
    Path(scenario).write_text(text + "  - failure: agent.x > 0\n", encoding="utf-8")
    allowed = Allowed(scenario)
    assert allowed.primitives.tolist() == [len(socialai_dsl.compile(socialai_dsl.load(scenario)).actions)]


def test_actions_are_in_the_space_and_differ_from_step_to_step(scenario: str) -> None:
    envs = socialai_dsl.make_vec(scenario, num_envs=8)
    for actions in (random_actions(envs, 1), walk_actions(8, Allowed(scenario), 1)):
        assert all(envs.action_space.contains(batch) for batch in actions)
        assert not np.array_equal(actions[0], actions[1])
    envs.close()


QUICK = ["--repeat", "1", "--seconds", "0.02"]


def test_the_report_is_json(scenario: str, capsys: Capture) -> None:
    command = [scenario, "--batch", "1,8", "--mix", "random", "--only", "ours", *QUICK]
    assert main([*command, "--json", "--out", "report.json", "--plot", "report.png"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads(Path("report.json").read_text(encoding="utf-8"))
    own = [row for row in report["rows"] if row["what"] == scenario]
    assert [row["batch"] for row in own] == [0, 1, 8]
    assert all(row["cpu_low"] <= row["cpu"] <= row["cpu_high"] for row in own)
    assert all(row["cpu"] > 0 and row["wall"] > 0 and row["ratio"] > 0 and row["resets"] > 0 for row in own)
    assert Path("report.png").read_bytes().startswith(b"\x89PNG")
    (memory,) = report["memory"]
    length = socialai_dsl.make(scenario).observation_space["tokens"].shape[0]  # type: ignore[index]
    assert memory["observation"] == 7 * 7 * 4 + 2 * length
    assert memory["call"] == 4 * 8 + 8 + 3 * 1 + 4 + 1


def test_wrong_usage(capsys: Capture) -> None:
    assert main(["--repeat", "0"]) == 2
    assert main(["--only", "nobody"]) == 2
    assert "expected one of ours, rules, programs, start" in capsys.readouterr().err
    assert main(["--train", "--plot", "x.png"]) == 2
    assert main(["--batch", "1,x"]) == 2


def peer(name: str, version: str | None, start: Callable[[int], Any], block: int = 1) -> SimpleNamespace:
    return SimpleNamespace(
        name=name,
        package=name,
        workload="Empty",
        batched=True,
        start=start,
        block=block,
        version=lambda: version,
    )


def test_peers_run_or_it_is_said_why_not(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    played: list[int] = []

    def broken(_: int) -> Any:
        raise RuntimeError("this release cannot")

    peers = (
        peer("absent", None, broken),
        peer("broken", "1.0", broken),
        peer(
            "slow",
            "2.0",
            lambda _: lambda steps: (played.append(steps), [sum(range(1000)) for _ in range(steps)]),
            16,
        ),
    )
    monkeypatch.setattr(engine, "PEERS", peers)
    command = ["--batch", "4", "--mix", "walk", "--only", "ours"]
    assert main([*command, *(f"--only={one.name}" for one in peers), *QUICK, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["missing"] == {"absent": "not installed", "broken": "RuntimeError: this release cannot"}
    assert report["versions"] == {"broken": "1.0", "slow": "2.0"}
    (row,) = (row for row in report["rows"] if row["kind"] == "peer")
    own = next(row for row in report["rows"] if row["kind"] == "ours" and row["batch"] == 4)
    assert row["what"] == "slow: Empty, 16 steps a call"
    assert row["ours"] == own["cpu"] / row["cpu"]
    assert all(steps % 16 == 0 for steps in played)
    assert main([*command, "--only=absent", *QUICK]) == 0
    assert "not measured: absent (not installed)" in capsys.readouterr().out


def test_the_limit_is_measured_under_the_same_actions(capsys: Capture) -> None:
    assert main(["--batch", "8", "--only", "ours", "--only", "c-portable", *QUICK, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    if report["missing"]:
        assert report["missing"] == {"c-portable": "there is no C compiler"}
        return
    speeds = {(row["kind"], row["mix"]): row["cpu"] for row in report["rows"] if row["batch"] == 8}
    for row in report["rows"]:
        if row["kind"] == "limit":
            assert row["ours"] == speeds["ours", row["mix"]] / row["cpu"]
    assert {("limit", "walk"), ("limit", "random")} <= speeds.keys()


def test_speed_is_the_median_and_its_spread(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by what the steps cost, and the CPU's half as fast."""
    now = [0.0]
    calls: list[int] = []
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(timing.time, "process_time", lambda: now[0] / 2)

    def run(steps: int) -> None:
        calls.append(steps)
        now[0] += steps * (0.25 if len(calls) % 2 else 0.5)

    speed = speed_of(run, 10, 4, 64.0, 8)
    assert all(steps % 8 == 0 for steps in calls)
    assert (speed.wall_low, speed.wall, speed.wall_high) == (20.0, 30.0, 40.0)
    assert (speed.cpu_low, speed.cpu, speed.cpu_high) == (40.0, 60.0, 80.0)


def test_preparing_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    calls: list[int] = []
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(timing.time, "process_time", lambda: now[0])

    def run(steps: int) -> None:
        calls.append(steps)
        now[0] += steps

    def prepare() -> None:
        now[0] += 1000

    assert speed_of(run, 3, 2, 100.0, 8, prepare).wall == 3.0
    assert set(calls) == {8}


def test_rule_heavy_actions_fire_rules_in_most_steps() -> None:
    envs: Any = socialai_dsl.make_vec("talkitout", num_envs=64)
    heavy = rule_heavy_actions(envs, Allowed("talkitout"), 1)
    horizon = envs.program.header(Header.HORIZON)
    assert heavy.actions.shape == (horizon, 64, 4), "every environment is reset once, as in the long run"
    assert heavy.fired > 0.4
    spoken = []
    for _ in range(2):
        envs.restore(heavy.start)
        spoken.append([envs.step(plan) and np.count_nonzero(envs.utterance_ids()) for plan in heavy.actions])
    assert spoken[0] == spoken[1], "from the state they belong to, the same comes of them every time"
    assert sum(spoken[0]) > 0.4 * horizon * 64


def test_programs_of_one_batch_differ() -> None:
    programs = different_programs(14)
    assert len(programs) == len(set(programs.values())) == 14


def test_actions_are_translated_by_spelling(scenario: str) -> None:
    envs: Any = socialai_dsl.make_vec(["talkitout", scenario], num_envs=2)
    own = socialai_dsl.compile(socialai_dsl.load(scenario))
    actions = np.array([[own.actions.index("forward"), 1, 1, 1], [len(own.actions), 0, 0, 0]])
    forward, none = translated(actions, scenario, envs.program)
    assert envs.program.actions[forward[0]] == "forward"
    assert none[0] == len(envs.program.actions), "no movement is the last"
    assert envs.program.templates[forward[2]] == own.templates[1]
    assert envs.program.nouns[forward[3]] == own.nouns[1]


@pytest.mark.thorough("measures two scenarios")
def test_scenarios_with_other_slots_in_one_batch() -> None:
    """Grammars with one slot, with three, and with one of another name."""
    names = ["talkitout", "novel/reference_game", "novel/gossip"]
    row = Ours([7], 1, 0.02).together(names, "walk")
    assert (row.what, row.batch) == ("3 scenarios mixed", 7)
    assert row.speed.cpu > 0


def test_programs_alone_and_together(scenario: str) -> None:
    names = {name: name for name in (scenario, "talkitout", "dance")}
    alone, mixed = Ours([9], 1, 0.02).programs(names)
    assert (alone.batch, mixed.batch) == (9, 9)
    assert alone.what == "3 programs (3 different), each alone"
    assert mixed.speed.cpu > 0


def test_a_peer_is_compared_with_walking_in_as_large_a_batch() -> None:
    def row(kind: str, mix: str, batch: int, cpu: float) -> Row:
        return Row("x", kind, mix, batch, Speed(cpu, cpu, cpu, cpu, cpu, cpu), None)

    report = Report("a machine", None, 1, 1e9)
    report.rows += [row("ours", "walk", 1, 10), row("ours", "random", 1, 2), row("ours", "random", 8, 6)]
    report.rows += [row("ours", "walk", 1, 50)]
    assert report.ours_in(row("peer", "random", 1, 5)) == 2, "the first scenario's"
    assert report.ours_in(row("limit", "random", 1, 4)) == 0.5
    assert report.ours_in(row("peer", "random", 8, 3)) == 2
    assert report.ours_in(row("limit", "walk", 8, 3)) is None
    assert report.ours_in(report.rows[0]) is None
