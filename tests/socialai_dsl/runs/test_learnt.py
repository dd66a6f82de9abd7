"""What an agent has learnt is said in the scenario's own words."""

import socialai_dsl as sd
from socialai_dsl.runs.learnt import Learnt
from socialai_dsl.traces.endings import endings_of


def learnt_of(name: str) -> Learnt:
    loaded = sd.load(name)
    return Learnt(loaded, endings_of(loaded, sd.compile(loaded)))


def test_answers_and_endings_are_told() -> None:
    rules = {
        "wizard.courtesy.stranger.then[0]": 0.5,
        "wizard.courtesy.acquainted.then[0]": 0.74,
        "honest.courtesy.acquainted.then[0]": 0.61,
        "liar.courtesy.acquainted.then[0]": 0.0,
    }
    names = sd.compile(sd.load("talkitout")).outcomes  # success, two failures, deadly, timeout
    outcomes = dict(zip(names, (0.6, 0.2, 0.1, 0.0, 0.1), strict=True))
    said = learnt_of("talkitout").sentence({"led": 0.0, "rules": rules, "outcomes": outcomes})
    assert said == (
        'per episode "Where is the exit" is answered by wizard 0.74, honest 0.61 times, "How are you" is answered by '
        "wizard 0.50 times; success 60%, failure 30%, out of time 10%"
    )


def test_while_the_script_leads_agreement_is_told() -> None:
    row = {"led": 1.0, "agreement": 0.874, "rules": {}, "outcomes": {}}
    assert learnt_of("dance").sentence(row) == "watching the script: would do the same in 87% of its steps"


def test_a_suite_tells_endings_alone() -> None:
    suite = learnt_of("social_env")
    names = sd.compile(sd.load("social_env")).outcomes
    outcomes = dict.fromkeys(names, 0.0) | {names[0]: 1.0}
    said = suite.sentence(
        {"led": 0.0, "rules": {"talkitout: wizard.courtesy.stranger.then[0]": 1.0}, "outcomes": outcomes}
    )
    assert said in ("success 100%, failure 0%, out of time 0%", "success 0%, failure 100%, out of time 0%")
