"""Every recipe of the cookbook is valid, is on the page, and is solved by the script in it."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.analysis.properties import Trial, by_default
from socialai_dsl.analysis.reports import Verdict
from socialai_dsl.cli import main
from socialai_dsl.frontend import check

DOCS = Path(__file__).parents[1] / "docs"
FILES = sorted((DOCS / "cookbook").rglob("*.yaml"))
PLAYED = [path for path in FILES if path.read_text(encoding="utf-8").startswith(("scenario:", "variant:"))]
CLAIMING = [path for path in PLAYED if "\ncheck: [{" in path.read_text(encoding="utf-8")]
EPISODES = 30


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_recipe_has_no_findings(path: Path) -> None:
    assert [str(diagnostic) for diagnostic in check(str(path)).diagnostics] == []


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_recipe_is_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) < 50


@pytest.mark.parametrize("path", PLAYED, ids=lambda path: path.stem)
def test_the_script_of_a_recipe_solves_it(path: Path) -> None:
    """Not every room: what stands in the way is drawn."""
    env = socialai_dsl.make(str(path))
    solved = 0
    for seed in range(EPISODES):
        env.reset(seed=seed)
        done, info = False, {}
        while not done:
            *_, terminated, truncated, info = env.step(env.unwrapped.scripted_action())  # type: ignore[attr-defined]
            done = terminated or truncated
        solved += bool(info["success"])
    assert solved >= 0.85 * EPISODES


def told(heard: list[str], sally_looks: bool) -> str | None:
    """Where Sally takes the ball to be, by what was said and which way she faces."""
    boxes = re.findall(r"in the (red|blue) box", " ".join(heard))
    return None if len(boxes) < 2 else boxes[1 if sally_looks else 0]


@pytest.mark.parametrize(
    ("policy", "least", "most"),
    [
        (lambda heard, sally_looks: "red", 0.25, 0.75),
        (lambda heard, sally_looks: told(heard, True), 0.25, 0.75),  # where the ball is
        (lambda heard, sally_looks: told(heard, False), 0.25, 0.75),  # where it was
        (told, 1.0, 1.0),
    ],
    ids=["blind guesser", "where it is", "where it was", "believer"],
)
def test_the_false_belief_takes_somebody_who_follows_it(
    policy: Callable[[list[str], bool], str | None], least: float, most: float
) -> None:
    env = socialai_dsl.make(str(DOCS / "cookbook" / "false_belief.yaml"))
    solved, up = 0, 3
    for seed in range(60):
        observation, info = env.reset(seed=seed)
        heard, done = [], False
        while not done:
            heard.append(info["utterance"])
            ahead = observation["image"][3, 5]  # Sally stands there
            box = policy(heard, ahead[3] == up) if len(heard) > 8 else None
            said = None if box is None else f"She looks in the {box} box"
            action = env.unwrapped.encode_action((None, said))  # type: ignore[attr-defined]
            observation, _, terminated, truncated, info = env.step(action)
            done = terminated or truncated
        solved += bool(info["success"])
    assert least <= solved / 60 <= most


def test_the_page_shows_every_file() -> None:
    page = (DOCS / "cookbook.md").read_text(encoding="utf-8")
    shown = re.findall(r"^```\{literalinclude\} (\S+)$", page, re.MULTILINE)
    assert sorted(shown) == [str(path.relative_to(DOCS)) for path in FILES]
    sections = page.split("\n## ")[1:]
    assert len(sections) >= 15
    assert [section.splitlines()[0] for section in sections if "literalinclude" not in section] == []


@pytest.mark.thorough("searches two rooms of each recipe")
@pytest.mark.parametrize("path", PLAYED, ids=lambda path: path.stem)
def test_success_is_knowable_unless_a_recipe_says_otherwise(path: Path) -> None:
    loaded = socialai_dsl.load(path)
    assert isinstance(loaded, socialai_dsl.LoadedScenario)
    place = loaded.resolved.tree.key_span(("outcome",))
    (plan,) = (plan for plan in by_default(loaded, place) if plan.kind == "knowable")
    assert plan.expected is (path.stem != "hidden_information_silent")
    scripted = loaded if any(frame.entity == 0 for frame in loaded.checked.frames) else None
    report = Trial(loaded, Effort(2), scripted).check(plan, Effort(2))
    assert report.verdict is Verdict.HOLDS, report.said


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("path", CLAIMING, ids=lambda path: path.stem)
def test_what_a_recipe_claims_holds_in_many_rooms(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What it does not claim itself, that all can be known, may be undecided in some room."""
    code = main.main(["check", str(path), "--rooms", "60", "--seconds", "0"])
    said = capsys.readouterr().out
    assert code == 0, said
    undecided = set(re.findall(r"^ *undecided: `(.+?)`", said, re.MULTILINE))
    claimed = {plan.text for plan in socialai_dsl.load(path).checked.properties}  # type: ignore[union-attr]
    assert not undecided & claimed, said


def test_many_recipes_claim_something() -> None:
    assert len(CLAIMING) >= 15
