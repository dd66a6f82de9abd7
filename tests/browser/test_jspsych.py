"""The plugin for jsPsych in a real browser, in real experiments, against the server of a study."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

import pytest

from socialai_dsl.frontend import check, load_study
from socialai_dsl.study.replay import study_data
from socialai_dsl.study.words import words_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).parents[2]
PLUGIN = ROOT / "web" / "jspsych-socialai"
EXAMPLE = "/web/jspsych-socialai/example/"
WORDS = words_of("en")
ALONE = """\
study: alone
consent: I agree.
blocks:
- {name: one, scenario: talkitout_no_liar, episodes: 2}
"""
TOGETHER = """\
study: together
consent: I agree.
blocks:
- {scenario: together/help_together, episodes: 2, seats: {agent: person, jill: person}, wait: 300}
"""
BARE = """\
<!doctype html>
<html lang="en"><meta charset="utf-8"><link rel="icon" href="data:,">
<link rel="stylesheet" href="/node_modules/jspsych/css/jspsych.css">
<script src="/node_modules/jspsych/dist/index.browser.js"></script>
<script src="/web/jspsych-socialai/dist/index.browser.min.js"></script>
<body></body>
<script>
const jsPsych = initJsPsych({on_finish: () => document.body.setAttribute("data-over", "")});
const timeline = TRIALS.map((trial) => ({type: jsPsychSocialai, ...trial}));
MODE ? jsPsych.simulate(timeline, MODE) : jsPsych.run(timeline);
</script>
"""

Start = Callable[..., str]


class Lab(SimpleHTTPRequestHandler):
    """Serves the repository's files, and a page that a test has written."""

    bare = ""

    def do_GET(self) -> None:
        if self.path != "/bare.html":
            super().do_GET()
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(self.bare.encode())

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="session")
def lab() -> Iterator[str]:
    """The origin of a laboratory that serves experiments: the repository's files, with what npm has installed."""
    if not (ROOT / "node_modules" / "jspsych").is_dir():
        pytest.skip("no experiment without jsPsych: npm ci")
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Lab, directory=str(ROOT)))
    Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


@contextmanager
def served(file: Path, out: Path, *options: str) -> Iterator[str]:
    """The address of a study that is served."""
    command = [sys.executable, "-m", "socialai_dsl", "study", "run", str(file), "--out", str(out), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip().split(": ")[1].removesuffix("/join")
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()


@pytest.fixture
def study(tmp_path: Path, lab: str) -> Iterator[Start]:
    """Starts the server of a study that admits the laboratory, or another one."""
    with ExitStack() as stack:

        def start(text: str, embed: str = lab) -> str:
            (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
            return stack.enter_context(
                served(tmp_path / "study.yaml", tmp_path / "out", "--port", "0", "--embed", embed)
            )

        yield start


def experiment(page: Page, lab: str, *trials: dict[str, Any], mode: str | None = None) -> None:
    """Open an experiment that has nothing but trials of the plugin."""
    Lab.bare = BARE.replace("TRIALS", json.dumps(trials)).replace("MODE", json.dumps(mode))
    page.goto(f"{lab}/bare.html")


def over(page: Page) -> list[dict[str, Any]]:
    """What jsPsych has when the experiment is over."""
    page.locator("body[data-over]").wait_for(timeout=60_000)
    found: list[dict[str, Any]] = page.evaluate("jsPsych.data.get().values()")
    return found


def play_out(*pages: Page) -> list[list[dict[str, Any]]]:
    """Let time pass on pages that simulate until their experiments are over, and return what they have."""
    for _ in range(600):
        if all(page.locator("body[data-over]").count() for page in pages):
            break
        for page in pages:
            page.clock.run_for(500)
            page.wait_for_timeout(10)
    return [over(page) for page in pages]


@pytest.mark.timeout(180)
def test_an_experiment_goes_from_consent_to_data_that_are_those_of_the_study(
    page: Page, lab: str, tmp_path: Path
) -> None:
    """By the keyboard alone, on a page that is loaded again in the middle of the second episode."""
    file, out = PLUGIN / "example" / "study.yaml", tmp_path / "out"
    with served(file, out, "--port", "0", "--embed", lab) as server:
        page.goto(f"{lab}{EXAMPLE}?PROLIFIC_PID=abc&server={server}")
        page.get_by_role("button", name="I agree").click()
        page.get_by_text("Round 1 of 2").wait_for()
        assert page.get_by_role("img", name=WORDS["sees"]).is_visible()
        page.keyboard.press("ArrowUp")
        page.get_by_text("Step 1", exact=True).wait_for()
        page.keyboard.press("/")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.get_by_text("Step 2", exact=True).wait_for()
        page.get_by_role("heading", level=1).focus()
        page.keyboard.press("x")  # done, which ends this scenario
        page.get_by_text(WORDS["failure"]).wait_for()
        page.keyboard.press("Enter")  # the button to go on has the focus
        page.get_by_text("Round 2 of 2").wait_for()
        page.keyboard.press("ArrowLeft")
        page.get_by_text("Step 1", exact=True).wait_for()
        page.reload()
        page.get_by_role("button", name="I agree").click()
        page.get_by_text("Round 2 of 2").wait_for()
        page.get_by_text("Step 1", exact=True).wait_for()
        page.keyboard.press("x")
        page.get_by_text(WORDS["failure"]).wait_for()
        page.keyboard.press("Enter")
        page.get_by_text("How hard was it?").wait_for()
        page.get_by_text("so-so").click()
        page.get_by_role("button", name="Continue").click()
        page.locator("#jspsych-data-display").wait_for()
        shown = json.loads(page.locator("#jspsych-data-display").text_content() or "")
    played = [trial for trial in shown if trial["trial_type"] == "socialai"]
    assert [(one["status"], one["trial"], one["more"]) for one in played] == [
        ("before", 1, True),
        ("played", 2, False),
    ]
    assert shown[-1]["response"] == {"effort": 2}
    tables = study_data(load_study(file), out).tables
    (person,) = tables["participants"]
    assert (person["agreed_at"], person["excluded"], bool(person["ended"])) == (lab, "", True)
    assert (out / "recruited.csv").read_text(encoding="utf-8").split() == ["p0001,abc"]
    for trial, row in zip(played, tables["episodes"], strict=True):
        for name in {*trial} & {*row}:
            assert trial[name] == row[name], name
        steps = [
            step for step in tables["steps"] if (step["game"], step["trial"]) == (row["game"], row["trial"])
        ]
        assert trial["acts"] == [
            {name: step[name] for name in act} for step, act in zip(steps, trial["acts"], strict=True)
        ]
    assert [len(trial["acts"]) for trial in played] == [3, 2]
    assert {step["connection"] for step in tables["steps"]} == {1, 2}


def test_what_is_shown_fits_a_phone(browser: Browser, lab: str, study: Start) -> None:
    context = browser.new_context(viewport={"width": 360, "height": 740}, has_touch=True)
    page = context.new_page()
    experiment(
        page, lab, {"server": study(ALONE.replace("study:", "language: de\nstudy:")), "consented": True}
    )
    page.get_by_role("button", name=words_of("de")["forward"]).tap()
    page.get_by_text("Schritt 1").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.locator(".jspsych-socialai").get_attribute("lang") == "de"
    context.close()


def test_trials_end_where_the_study_has_no_episode_left(page: Page, lab: str, study: Start) -> None:
    experiment(page, lab, *[{"server": study(ALONE), "consented": True}] * 3)
    for number in (1, 2):
        page.get_by_text(f"Round {number} of 2").wait_for()
        page.keyboard.press("x")
        page.get_by_role("button", name=WORDS["next"]).click()
    assert [trial["status"] for trial in over(page)] == ["played", "played", "over"]


def test_an_episode_whose_trial_the_experiment_ends_goes_on_in_the_next_trial(
    page: Page, lab: str, study: Start
) -> None:
    experiment(page, lab, *[{"server": study(ALONE), "consented": True}] * 2)
    page.get_by_text("Step 0", exact=True).wait_for()
    page.keyboard.press("ArrowLeft")
    page.get_by_text("Step 1", exact=True).wait_for()
    page.evaluate("jsPsych.finishTrial({cut: true})")
    page.wait_for_function("jsPsych.getProgress().current_trial_global === 1")
    page.get_by_text("Step 1", exact=True).wait_for()
    page.keyboard.press("x")
    page.get_by_role("button", name=WORDS["next"]).click()
    first, second = over(page)
    assert (first["cut"], second["trial"], second["steps"]) == (True, 1, 2)


def bad(browser: Browser) -> tuple[Page, Any]:
    """A page on which scripts may complain."""
    context = browser.new_context()
    return context.new_page(), context


@pytest.mark.parametrize(
    ("more", "why", "told"),
    [
        ({"server": "http://127.0.0.1:9"}, "silent", WORDS["silent"]),
        ({"consented": False}, "parameters", "consented: got false, expected true"),
        (
            {"server": "study.example.org"},
            "parameters",
            'server: got "study.example.org", expected an address',
        ),
        (
            {"participant": ""},
            "parameters",
            'participant: got "", expected null, or a text of 1 to 200 characters',
        ),
        ({"serve": 1}, "parameters", "got the parameter serve, expected server, consented, participant"),
    ],
)
def test_bad_input_is_told_in_the_page_and_in_the_data_and_the_timeline_goes_on(
    more: dict[str, Any], why: str, told: str, browser: Browser, lab: str
) -> None:
    page, context = bad(browser)
    usual = {"server": "http://127.0.0.1:9", "consented": True, "connection_timeout": 500}
    experiment(page, lab, {**usual, **more}, {**usual, "consented": False})
    page.get_by_role("alert").filter(has_text=told).wait_for()
    for _ in range(2):
        page.keyboard.press("Enter")  # the button to go on has the focus
        page.wait_for_timeout(100)
    first, second = over(page)
    assert (first["status"], first["error"], second["error"]) == ("failed", why, "parameters")
    assert told in first["message"]
    context.close()


def test_a_page_of_another_origin_is_told_how_it_can_be_admitted(
    browser: Browser, lab: str, study: Start
) -> None:
    page, context = bad(browser)
    experiment(page, lab, {"server": study(ALONE, embed="https://lab.example.org"), "consented": True})
    page.get_by_text(f"--embed {lab}").wait_for()
    page.keyboard.press("Enter")
    assert over(page)[0]["error"] == "origin"
    context.close()


def test_a_study_that_was_begun_anew_says_so_and_goes_on_from_the_first_episode(
    browser: Browser, lab: str, tmp_path: Path
) -> None:
    page, context = bad(browser)
    file = tmp_path / "study.yaml"
    file.write_text(ALONE, encoding="utf-8")
    with served(file, tmp_path / "first", "--port", "0", "--embed", lab) as server:
        experiment(page, lab, *[{"server": server, "consented": True}] * 2)
        page.get_by_text("Round 1 of 2").wait_for()
        page.keyboard.press("ArrowLeft")
        page.get_by_text("Step 1", exact=True).wait_for()
    page.get_by_text(WORDS["offline"]).wait_for()
    with served(file, tmp_path / "first", "--port", server.rpartition(":")[2], "--embed", lab):
        page.get_by_text(WORDS["offline"]).wait_for(state="detached")
        page.get_by_text("Step 1", exact=True).wait_for()
    page.get_by_text(WORDS["offline"]).wait_for()
    with served(file, tmp_path / "second", "--port", server.rpartition(":")[2], "--embed", lab):
        page.get_by_text(WORDS["forgotten"]).wait_for()
        page.keyboard.press("Enter")
        page.get_by_text("Step 0", exact=True).wait_for()
        page.keyboard.press("x")
        page.get_by_role("button", name=WORDS["next"]).click()
        assert [trial["status"] for trial in over(page)] == ["failed", "played"]
    (kept,) = study_data(load_study(file), tmp_path / "first").tables["steps"]
    assert kept["movement"] == "left"
    context.close()


def test_a_second_window_of_the_same_participant_takes_over(browser: Browser, lab: str, study: Start) -> None:
    page, context = bad(browser)
    trial = {"server": study(ALONE), "consented": True, "participant": "abc"}
    experiment(page, lab, trial)
    page.get_by_text("Round 1 of 2").wait_for()
    second = context.new_page()
    experiment(second, lab, trial)
    second.get_by_text("Round 1 of 2").wait_for()
    page.get_by_text(WORDS["elsewhere"]).wait_for()
    page.keyboard.press("Enter")
    assert over(page)[0]["error"] == "elsewhere"
    second.keyboard.press("ArrowLeft")
    second.get_by_text("Step 1", exact=True).wait_for()
    context.close()


def test_two_people_wait_for_each_other_and_play_together(browser: Browser, lab: str, study: Start) -> None:
    server = study(TOGETHER)
    context = browser.new_context()
    pages = [context.new_page(), context.new_page()]
    for number, page in enumerate(pages):
        page.clock.install()
        trial = {"server": server, "consented": True, "participant": str(number)}
        experiment(page, lab, trial, trial, mode="visual")
        if not number:
            page.get_by_text(WORDS["room"]).wait_for()
    first, second = play_out(*pages)
    assert [trial["status"] for trial in (*first, *second)] == ["played"] * 4
    for one, other in zip(first, second, strict=True):
        assert (one["game"], one["trial"], one["steps"]) == (other["game"], other["trial"], other["steps"])
        assert {act["by"] for act in (*one["acts"], *other["acts"])} == {"person"}
    context.close()


def test_in_the_mode_of_data_only_nobody_asks_a_server(page: Page, lab: str) -> None:
    trial = {
        "server": "http://127.0.0.1:9",
        "consented": True,
        "simulation_options": {"data": {"success": True}},
    }
    experiment(page, lab, trial, mode="data-only")
    (made,) = over(page)
    assert (made["success"], made["simulated"], made["steps"]) == (True, True, len(made["acts"]))
    promised = set(page.evaluate("Object.keys(jsPsychSocialai.info.data)"))
    assert promised - {*made} == {"error", "message"}, "which only trials that failed have"


def test_in_the_visual_mode_the_server_knows_that_nobody_sits_there(
    page: Page, lab: str, study: Start, tmp_path: Path
) -> None:
    trial = {"server": study(ALONE), "consented": True}
    page.clock.install()
    experiment(page, lab, trial, trial, mode="visual")
    (played,) = play_out(page)
    assert [(one["status"], one["simulated"]) for one in played] == [("played", True)] * 2
    tables = study_data(load_study(tmp_path / "study.yaml"), tmp_path / "out").tables
    assert [row["excluded"] for row in tables["participants"]] == ["simulated"]
    assert [row["steps"] for row in tables["episodes"]] == [one["steps"] for one in played]


@pytest.mark.skipif(shutil.which("node") is None, reason="nothing is bundled without Node")
def test_what_is_bundled_is_the_screen_of_the_study_as_it_is(lab: str, tmp_path: Path) -> None:
    subprocess.run(["node", str(PLUGIN / "build.js"), str(tmp_path)], cwd=ROOT, check=True)
    made = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert made == {file.name: file.read_bytes() for file in (PLUGIN / "dist").iterdir()}, "npm run bundle"
    assert (PLUGIN / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_the_study_of_the_example_has_no_findings() -> None:
    assert [str(one) for one in check(PLUGIN / "example" / "study.yaml").diagnostics] == []


def test_the_page_of_the_plugin_names_all_that_it_takes_and_gives(page: Page, lab: str) -> None:
    experiment(page, lab, {"server": "http://127.0.0.1:9", "consented": True}, mode="data-only")
    info = page.evaluate("jsPsychSocialai.info")
    text = (ROOT / "docs" / "jspsych.md").read_text(encoding="utf-8")
    names = [*info["parameters"], *info["data"], *info["data"]["acts"]["nested"]]
    assert [name for name in names if f"`{name}`" not in text] == []
    assert info["version"] == json.loads((PLUGIN / "package.json").read_text(encoding="utf-8"))["version"]
