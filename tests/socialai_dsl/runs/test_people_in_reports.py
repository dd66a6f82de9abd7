"""People of a study beside scripts and chance: what a report says of them is what one counts by hand."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
from statistics import fmean, median

import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import main
from socialai_dsl.frontend import load_study
from socialai_dsl.study.live import Live
from tests.socialai_dsl.reporting.page_reader import Page
from tests.socialai_dsl.study.participants import Clock, loaded_study, meet, pass_time, run

pytest.importorskip("websockets", reason="studies need the extra studio")
pytest.importorskip("uvicorn", reason="studies need the extra studio")

STUDY = """\
study: {name}
consent: I agree.
blocks:
- {{name: guides, scenario: talkitout, episodes: 4}}
- {{name: trust, scenario: classics/selective_trust, episodes: 3, view: picture, feedback: none}}
questions:
- {{id: how, ask: How did you decide?}}
- {{id: hard, ask: How hard was it?, kind: scale, from: 1, to: 5}}
- {{id: lied, ask: Did somebody lie?, kind: choice, options: [yes it was so, no it was not]}}
"""
KINDS = ("script", "random", "slow", "leaving", "random")
Row = dict[str, str]


def rehearsed(folder: Path, name: str = "asking", kinds: tuple[str, ...] = KINDS) -> Path:
    from socialai_dsl.study.rehearsal import rehearse

    file = folder / f"{name}.yaml"
    file.write_text(STUDY.format(name=name), encoding="utf-8")
    out = folder / f"{name}_rehearsal"
    out.mkdir()
    rehearse(load_study(file), out, len(kinds), speed=800, kinds=kinds)
    return out


def rows(file: Path) -> list[Row]:
    with open(file, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that simulated people took part in, and evaluations of the script and of chance."""
    folder = tmp_path_factory.mktemp("people")
    rehearsed(folder)
    for agent in ("oracle", "random"):
        sd.evaluate(agent, "talkitout", 6, out=folder / agent, record=0, trials=2)
    sd.evaluate("oracle", "classics/selective_trust", 3, out=folder / "oracle", record=0)
    return folder


def inputs(place: Path) -> list[str]:
    named = ("asking_rehearsal", "oracle/talkitout", "oracle/selective_trust", "random/talkitout")
    return [str(place / name) for name in named]


@pytest.fixture(scope="module")
def report(place: Path) -> Path:
    out = place / "report"
    assert main(["report", *inputs(place), "--no-baselines", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def data(place: Path) -> dict[str, list[Row]]:
    """The tables of the study, as `study data` writes them."""
    study = str(place / "asking.yaml")
    assert (
        main(["study", "data", study, "--out", str(place / "asking_rehearsal"), "--to", str(place / "data")])
        == 0
    )
    tables = ("participants", "episodes", "steps", "asked", "rules", "answers")
    return {name: rows(place / "data" / "data" / f"study-asking_table-{name}_data.csv") for name in tables}


def counted(data: dict[str, list[Row]], block: str) -> list[Row]:
    """Episodes of a block of those who are not excluded."""
    who = {row["participant"] for row in data["participants"] if not row["excluded"]}
    assert len(who) == len(KINDS) - 1, "one leaves"
    return [row for row in data["episodes"] if row["block"] == block and row["participant"] in who]


BLOCKS = {"guides": "talkitout", "trust": "classics/selective_trust"}


@pytest.mark.parametrize("block", BLOCKS)
def test_success_steps_and_endings_are_those_counted_by_hand(
    report: Path, data: dict[str, list[Row]], block: str
) -> None:
    episodes = counted(data, block)
    name = f"{BLOCKS[block]} / simulated people"
    (mind,) = [row for row in rows(report / "minds.csv") if row["condition"] == name]
    won = [row["success"] == "True" for row in episodes]
    assert (int(mind["episodes"]), float(mind["success"])) == (len(episodes), pytest.approx(fmean(won)))
    assert (mind["clusters_are"], int(mind["clusters"])) == ("people", len(KINDS) - 1)
    assert float(mind["mean_steps"]) == pytest.approx(fmean(int(row["steps"]) for row in episodes))
    for trial in rows(report / "trials.csv"):
        if trial["condition"] == name:
            own = [row["success"] == "True" for row in episodes if row["trial"] == trial["trial"]]
            assert (int(trial["episodes"]), float(trial["success"])) == (len(own), pytest.approx(fmean(own)))
    ended = Counter(row["outcome"] for row in episodes)
    outcomes: defaultdict[str, float] = defaultdict(float)
    for row in rows(report / "outcomes.csv"):
        if (row["condition"], row["kind"]) == (name, "outcome"):
            outcomes[row["name"]] += float(row["per_episode"]) * len(episodes) / (len(KINDS) - 1)
    assert {key: round(value) for key, value in outcomes.items() if value} == ended


def test_whom_they_asked_follows_from_what_was_said_and_heard(
    report: Path, data: dict[str, list[Row]]
) -> None:
    """In TalkItOut nobody speaks unless asked, and whoever is near hears it: each line is an answer."""
    episodes = counted(data, "guides")
    heard: dict[tuple[str, str], list[str]] = {(row["game"], row["trial"]): [] for row in episodes}
    for step in data["steps"]:
        if step["said"] and step["heard"] and (step["game"], step["trial"]) in heard:
            heard[step["game"], step["trial"]] += step["heard"].split("\n")
    by_name = {"Gandalf": "wizard"}
    orders = Counter(
        len(dict.fromkeys(line.partition(":")[0] for line in lines if line)) for lines in heard.values()
    )
    own = [row for row in rows(report / "orders.csv") if row["condition"] == "talkitout / simulated people"]
    told = Counter[int]()
    for row in own:
        told[0 if row["order"] == "(nobody)" else len(row["order"].split(" > "))] += int(row["episodes"])
    assert told == orders
    firsts = Counter(by_name.get(lines[0].partition(":")[0]) if lines else None for lines in heard.values())
    asked = {
        row["by"]: row
        for row in rows(report / "asked.csv")
        if row["condition"] == "talkitout / simulated people"
    }
    assert float(asked["wizard"]["first"]) == pytest.approx(firsts["wizard"] / len(episodes))
    answers = sum(float(row["answers_per_episode"]) for row in asked.values()) * len(episodes)
    assert round(answers) == sum(map(len, heard.values())) > 0


def test_pairs_by_room_are_those_counted_by_hand(
    report: Path, data: dict[str, list[Row]], place: Path
) -> None:
    own: defaultdict[str, list[bool]] = defaultdict(list)
    for row in counted(data, "guides"):
        own[row["room"]].append(row["success"] == "True")
    other = {
        row["episode"]: int(row["success"]) for row in rows(place / "random" / "talkitout" / "episodes.csv")
    }
    expected = fmean(other[room] - fmean(won) for room, won in own.items())
    names = {"talkitout / random, 2 trials", "talkitout / simulated people"}
    (pair,) = [row for row in rows(report / "rooms.csv") if {row["first"], row["second"]} == names]
    sign = 1 if pair["first"].startswith("talkitout / random") else -1
    assert int(pair["rooms"]) == len(own) == 4
    assert sign * float(pair["difference"]) == pytest.approx(expected)


def test_times_and_answers_are_those_of_the_tables(report: Path, data: dict[str, list[Row]]) -> None:
    games = {(row["game"], row["trial"]) for row in counted(data, "guides")}
    took = [
        float(row["reaction_ms"])
        for row in data["steps"]
        if row["reaction_ms"] and (row["game"], row["trial"]) in games
    ]
    condition = "talkitout / simulated people"
    (times,) = [
        row for row in rows(report / "times.csv") if (row["condition"], row["trial"]) == (condition, "")
    ]
    assert (int(times["acts"]), float(times["median_ms"])) == (len(took), pytest.approx(median(took)))
    given = Counter((row["question"], row["answer"]) for row in data["answers"])
    told = {(row["question"], row["answer"]): int(row["times"]) for row in rows(report / "answers.csv")}
    assert {key: count for key, count in told.items() if count} == {
        key: count for key, count in given.items() if key[0] != "how"
    }
    texts = rows(report / "free_text.csv")
    assert Counter(row["answer"] for row in texts) == Counter(
        row["answer"] for row in data["answers"] if row["question"] == "how"
    )


def test_the_page_has_all_minds_side_by_side_and_says_that_people_are_simulated(report: Path) -> None:
    text = (report / "index.html").read_text(encoding="utf-8")
    page = Page(text)
    assert "With simulated people: a rehearsal, in which no person took part." in page.text
    assert "Study: asking (simulated)" in page.text
    assert (
        "5 simulated participants came, and 4 of them count; left out by the study's own rules: 1 unfinished."
        in (page.text)
    )
    players = {row[0]: row[1:] for row in page.table("kind of mind")}
    assert players["talkitout / simulated people"] == [
        "simulated person", "nothing", "its seat's view, in a picture and in words", "4 episodes", "yes",
    ]  # fmt: skip
    assert players["classics/selective_trust / simulated people"][1:] == [
        "instructions", "its seat's view, in a picture", "3 episodes", "no",
    ]  # fmt: skip
    assert players["talkitout / random, 2 trials"][3:] == ["2 episodes", "no"]
    assert {row[0] for row in page.table("asked first")} >= {"wizard", "honest", "nobody"}
    assert any(row[0] == "wizard > honest" for row in page.table("in which order"))
    assert ["How are you", "wizard"] in [row[:2] for row in page.table("answered by")]
    assert page.table("trial")
    assert [row[0] for row in page.table("ended by")]
    assert "(script)" not in text, "what people said in their own words stands in a file"
    simulated = [row for row in rows(report / "minds.csv") if row["simulated"] == "True"]
    assert {row["study"] for row in simulated} == {"asking"}
    for name in ("trials", "people", "asked", "orders", "exchanges", "times", "answers", "free_text"):
        assert {row["simulated"] for row in rows(report / f"{name}.csv") if row["study"]} == {"True"}, name
    for figure in ("part1-trials1", "part1-trials2"):
        assert (report / "figures" / f"{figure}.svg").is_file()


def test_a_rehearsal_says_that_it_is_one_in_its_log_and_its_data(
    place: Path, data: dict[str, list[Row]], capsys: pytest.CaptureFixture[str]
) -> None:
    first = json.loads((place / "asking_rehearsal" / "log.jsonl").read_text(encoding="utf-8").split("\n")[0])
    assert (first["simulated"], first["file"]) == (True, "../asking.yaml")
    assert {row["simulated"] for table in data.values() for row in table} == {"True"}
    assert "Simulated" in (place / "data" / "codebook.md").read_text(encoding="utf-8")
    study, log = str(place / "asking.yaml"), str(place / "asking_rehearsal")
    assert main(["study", "status", study, "--out", log]) == 0
    assert "5 began, 4 finished; all of them simulated, in a rehearsal" in capsys.readouterr().out

    with pytest.raises(
        ValueError, match="holds a rehearsal, and simulated participants stay apart from people"
    ):
        Live(load_study(place / "asking.yaml"), place / "asking_rehearsal")


TOGETHER = """\
study: together
consent: I agree.
blocks:
- scenario: together/help_together
  episodes: 3
  seats: {agent: person, jill: person}
  wait: 3600
  act_within: 3600
  away: 600
"""


def test_two_people_in_one_room_stand_beside_those_who_play_both_seats(tmp_path: Path) -> None:
    """Whoever plays together is one cluster; a script that may stand in makes no other scenario of it."""
    from socialai_dsl.study.rehearsal import rehearse

    (tmp_path / "together.yaml").write_text(TOGETHER, encoding="utf-8")
    (tmp_path / "log").mkdir()
    rehearse(
        load_study(tmp_path / "together.yaml"), tmp_path / "log", 4, speed=100, kinds=("script", "random")
    )
    script = sd.evaluate("oracle", "together/help_together", 3, out=tmp_path / "oracle", record=0)
    assert script.folder is not None
    out = tmp_path / "report"
    assert (
        main(["report", str(tmp_path / "log"), str(script.folder), "--no-baselines", "--out", str(out)]) == 0
    )
    people = [row for row in rows(out / "minds.csv") if row["kind"] == "person"]
    assert {row["condition"].partition(" / ")[2] for row in people} == {
        "simulated people (jill by a person)",
        "simulated people (as jill, agent by a person)",
    }
    assert {(row["episodes"], row["clusters"]) for row in people} == {("6", "2")}
    assert len({row["program_sha256"] for row in rows(out / "minds.csv")}) == 1
    (pair,) = rows(out / "rooms.csv")
    assert "oracle" in pair["first"]
    assert "(jill by a person)" in pair["second"], "those on the same seat"
    assert pair["rooms"] == "3"


def test_episodes_with_stand_ins_are_conditions_of_their_own(tmp_path: Path) -> None:
    """Two people play an episode; then one leaves, who does not count, and the other plays two with a stand-in."""
    (tmp_path / "log").mkdir()
    loaded = loaded_study(TOGETHER.replace("away: 600", "away: 5"), tmp_path)

    async def play() -> None:
        clock = Clock()
        live = Live(loaded, tmp_path / "log", clock)
        people = await meet(live)
        for number in range(3):
            while not all(one.now.get("ended") for one in people.values()):
                for one in people.values():
                    await one.act("left")
            for one in people.values():
                await one.go()
            if number == 0:
                for one in people.values():
                    await one.act("left")
                leaves = people.pop("jill")
                assert leaves.page is not None
                live.go(leaves.page)
                await pass_time(live, clock, 6, *people.values())
        await live.close()

    run(play)
    assert main(["report", str(tmp_path / "log"), "--no-baselines", "--out", str(tmp_path / "report")]) == 0
    minds = {row["condition"]: row["episodes"] for row in rows(tmp_path / "report" / "minds.csv")}
    assert {name.partition(" / ")[2]: count for name, count in minds.items()} == {
        "people (jill by a person)": "1",
        "people (jill by a person, in part by stand-ins)": "2",
    }


# -- what is wrong with a study ----------------------------------------------------------------------------------------


@pytest.fixture
def copied(place: Path, tmp_path: Path) -> Path:
    """The study and its log, to be spoilt."""
    for name in ("asking.yaml", "asking_rehearsal"):
        copy = shutil.copytree if (place / name).is_dir() else shutil.copy
        copy(place / name, tmp_path / name)
    return tmp_path


def remarks_of(place: Path, folders: list[Path], capsys: pytest.CaptureFixture[str], out: Path) -> list[str]:
    """What the command prints as wrong, where the report is made all the same, and says it as well."""
    runs = inputs(place)[1:]
    capsys.readouterr()
    assert main(["report", *map(str, folders), *runs, "--no-baselines", "--out", str(out)]) == 0
    told = capsys.readouterr().err.strip().split("\n")
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    for line in told:
        assert " ".join(line.split()) in page.text
    assert len([row for row in rows(out / "minds.csv") if not row["study"]]) == 3, "the rest is used"
    return told


def test_a_damaged_log_is_left_out_with_its_line(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = copied / "asking_rehearsal" / "log.jsonl"
    lines = log.read_bytes().split(b"\n")
    lines[20] = b"{"
    log.write_bytes(b"\n".join(lines))
    (told,) = remarks_of(place, [log.parent], capsys, copied / "report")
    assert told.startswith("study in asking_rehearsal left out: ")
    assert "log.jsonl:21: expected an event" in told


def test_an_act_that_was_changed_is_found(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = copied / "asking_rehearsal" / "log.jsonl"
    events = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    ended = next(event for event in events if event["event"] == "ended")
    ended["success"] = {seat: not won for seat, won in ended["success"].items()}
    log.write_text("".join(json.dumps(event) + "\n" for event in events), encoding="utf-8")
    (told,) = remarks_of(place, [log.parent], capsys, copied / "report")
    assert "the episode came out as" in told


def test_a_study_of_another_version_of_its_scenarios_is_left_out(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = copied / "asking_rehearsal" / "log.jsonl"
    text = log.read_text(encoding="utf-8")
    digest = json.loads(text.split("\n")[0])["programs"]["guides"]
    log.write_text(text.replace(digest, "0" * 64), encoding="utf-8")
    (told,) = remarks_of(place, [log.parent], capsys, copied / "report")
    assert "is of another study, or of other versions of its scenarios" in told


def test_a_study_whose_file_is_gone_is_left_out(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (copied / "asking.yaml").unlink()
    (told,) = remarks_of(place, [copied / "asking_rehearsal"], capsys, copied / "report")
    assert "asking.yaml, which is not there; put it back, or move both together" in told


def test_a_study_whose_file_has_mistakes_is_left_out(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = copied / "asking.yaml"
    file.write_text(
        file.read_text(encoding="utf-8").replace("episodes: 4", "episodes: none"), encoding="utf-8"
    )
    (told,) = remarks_of(place, [copied / "asking_rehearsal"], capsys, copied / "report")
    assert "asking.yaml:4" in told


def test_a_study_that_goes_on_counts_as_far_as_it_is(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Cut behind the step in which the first who had come to the end did so; the others are unfinished."""
    log = copied / "asking_rehearsal" / "log.jsonl"
    lines = log.read_text(encoding="utf-8").splitlines(keepends=True)
    finished = [number for number, line in enumerate(lines) if json.loads(line)["event"] == "answered"]
    log.write_text("".join(lines[: finished[0] + 1]), encoding="utf-8")
    told = remarks_of(place, [log.parent], capsys, copied / "report")
    (one,) = told
    assert re.fullmatch(r"study asking: \d+ episodes? (have|has) not ended, and do(es)? not count", one)
    minds = [row for row in rows(copied / "report" / "minds.csv") if row["study"]]
    assert {row["clusters"] for row in minds} == {"1"}
    assert {row["success_low"] for row in minds} == {""}, "of one person no interval is known"


def test_two_studies_of_one_name_are_told_apart(
    place: Path, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(copied / "asking_rehearsal")
    other = rehearsed(copied, kinds=("random",)).rename(copied / "elsewhere")
    live = place / "asking_rehearsal"
    told = remarks_of(place, [live, other, live], capsys, copied / "report")
    assert "2 studies are called 'asking'; they are told apart by their folders" in told
    studies = {row["study"] for row in rows(copied / "report" / "minds.csv") if row["study"]}
    assert studies == {"asking in asking_rehearsal", "asking in elsewhere"}


def test_a_study_whose_scenario_no_run_has_stands_alone(
    place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [inputs(place)[1]]
    capsys.readouterr()
    assert main(["report", inputs(place)[0], *runs, "--no-baselines", "--out", str(tmp_path)]) == 0
    assert "study asking: no run has the scenario selective_trust" in capsys.readouterr().err
    assert {row["row"] for row in rows(tmp_path / "conditions.csv")} == {"talkitout", "selective_trust"}


def test_a_report_of_a_study_alone_has_its_people(place: Path, tmp_path: Path) -> None:
    assert main(["report", inputs(place)[0], "--no-baselines", "--out", str(tmp_path)]) == 0
    page = Page((tmp_path / "index.html").read_text(encoding="utf-8"))
    assert "Study asking: 4 simulated participants." in page.text
    assert "0 of 0 runs" not in page.text
    assert not (tmp_path / "runs.csv").exists()


def test_where_nothing_can_be_believed_there_is_no_report(
    copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (copied / "asking.yaml").unlink()
    assert main(["report", str(copied / "asking_rehearsal"), "--out", str(copied / "report")]) == 2
    assert "which is not there" in capsys.readouterr().err
    assert not (copied / "report").exists()


# -- tables that were written before -------------------------------------------------------------------------------


def test_tables_of_a_study_make_the_same_report_as_its_log(
    place: Path, report: Path, data: dict[str, list[Row]], tmp_path: Path
) -> None:
    """Also where neither the study's file nor its log is there any more."""
    moved = tmp_path / "elsewhere"
    shutil.copytree(place / "data", moved)
    out = tmp_path / "report"
    assert main(["report", str(moved), *inputs(place)[1:], "--no-baselines", "--out", str(out)]) == 0
    written = sorted(file.name for file in report.glob("*.csv"))
    assert {"minds.csv", "trials.csv", "rooms.csv", "asked.csv", "answers.csv", "times.csv"} <= {*written}
    assert written == sorted(file.name for file in out.glob("*.csv"))
    for name in written:
        assert (out / name).read_text(encoding="utf-8") == (report / name).read_text(encoding="utf-8"), name


def test_the_same_people_are_not_counted_twice(
    place: Path, data: dict[str, list[Row]], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folders = [place / "asking_rehearsal", place / "data"]
    assert main(["report", *map(str, folders), "--no-baselines", "--out", str(tmp_path / "report")]) == 0
    assert "study in data left out: asking_rehearsal has the same people" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda folder: folder / "data", "name the folder above"),
        (lambda folder: (folder / "study.json").unlink(), "write it again with `socialai study data`"),
        (lambda folder: (folder / "study.json").write_text("{}"), "study.json: is damaged"),
        (lambda folder: next(folder.glob("data/*episodes*")).unlink(), "is not there"),
        (lambda folder: edited(next(folder.glob("data/*episodes*"))), "was changed since it was written"),
    ],
)
def test_tables_that_cannot_be_read_are_refused_with_a_cure(
    spoil: Callable[[Path], Path | None],
    why: str,
    place: Path,
    data: dict[str, list[Row]],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    shutil.copytree(place / "data", tmp_path / "spoilt")
    named = spoil(tmp_path / "spoilt")
    folder = named if isinstance(named, Path) else tmp_path / "spoilt"
    assert main(["report", str(folder), "--no-baselines", "--out", str(tmp_path / "report")]) == 2
    assert why in capsys.readouterr().err
    (told,) = remarks_of(place, [folder], capsys, tmp_path / "report")
    assert why in told


def edited(table: Path) -> None:
    table.write_text(table.read_text(encoding="utf-8").replace("False", "True"), encoding="utf-8")
