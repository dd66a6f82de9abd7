"""The engine and the reference interpreter of the language agree on everything an episode shows and does."""

from pathlib import Path

import pytest

from tests.agreement import agree

SAMPLES = sorted(str(path) for path in (Path(__file__).parent / "data" / "agreement").glob("*.yaml"))
SHIPPED = [
    "talkitout",
    "talkitout_no_liar",
    "talkitout+unsocial",
    "talkitout+as_coded",
    "talkitout_no_liar+as_coded",
    "talkitout_no_liar+as_coded+unsocial",
    "talkitout+oracle",
    "talkitout_no_liar+oracle",
]
# Samples have no oracle that shortens their episodes, so fewer of them make as many steps.
SHORT = dict.fromkeys(SHIPPED, 60) | dict.fromkeys(SAMPLES, 30)


@pytest.mark.parametrize("name", SHORT, ids=lambda name: Path(name).stem)
def test_agreement(name: str) -> None:
    steps = agree(name, SHORT[name], seed=11)
    assert steps > SHORT[name], "the episodes were too short to mean anything"


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", SHORT, ids=lambda name: Path(name).stem)
def test_agreement_over_a_thousand_episodes(name: str) -> None:
    agree(name, 1000, seed=12)
