"""What an evaluation leaves in a folder: films, transcripts, a page of episodes, lists of episodes and of answers."""

import csv
import io
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from socialai_dsl.atomic import write_text
from socialai_dsl.episodes.asking import Answer
from socialai_dsl.evaluation.asked import asked_in
from socialai_dsl.evaluation.test_set import Evaluation
from socialai_dsl.runs.folder import ASKED, EPISODES, REPLAY, only_writer, scenario_folder_name
from socialai_dsl.traces.page import replay_page

_RECORDING: Final = re.compile(r"(success|failure)-\d+\.(gif|txt)")


def record(evaluation: Evaluation, folder: Path, count: int = 3, label: str = "") -> Path:
    """`write_recordings` as the only writer of the folder.

    Raises:
        UsageError: another process writes there.
        ValueError: it is none of `evaluate`'s.
        OSError: a file cannot be written.
    """
    if not isinstance(evaluation, Evaluation):
        raise ValueError(f"evaluation: got an {type(evaluation).__name__}, expected what `evaluate` returns")
    with only_writer(folder):
        return write_recordings(evaluation, folder, count, label)


def write_recordings(evaluation: Evaluation, folder: Path, count: int = 3, label: str = "") -> Path:
    """Record up to `count` successes and as many failures, a page with them included, and list all episodes.

    Recordings and page of an earlier evaluation go, unless its episodes were the same.

    Args:
        evaluation: what was played.
        folder: gets a folder named after the scenario, which is returned.
        count: films and transcripts of either kind.
        label: how the recordings call the agent (default: by its name).

    Raises:
        OSError: a file cannot be written.
    """
    place = folder / scenario_folder_name(evaluation.scenario)
    place.mkdir(parents=True, exist_ok=True)
    before = (place / EPISODES).read_bytes() if (place / EPISODES).is_file() else b""
    write_tables(evaluation, place)
    if (place / EPISODES).read_bytes() != before:
        for file in place.iterdir():
            if file.name == REPLAY or _RECORDING.fullmatch(file.name):
                file.unlink()
    replayed = evaluation.to_replay(count)
    for number in replayed:
        if evaluation.is_cut_short(number):  # no step ended it, so a film has no end to show
            continue
        episode = evaluation.record(number, label or f"agent {evaluation.player.agent}")
        name = f"{'success' if evaluation.result.success[number] else 'failure'}-{number:03d}"
        write_text(place / f"{name}.txt", episode.transcript())
        episode.save_film(place / f"{name}.gif")
    if traces := evaluation.traces(replayed):
        write_text(place / REPLAY, replay_page(traces))
    return place


def write_tables(evaluation: Evaluation, folder: Path) -> None:
    """Write a table with a row for each test episode, and one with a row for each answer that the player got.

    Raises:
        OSError: a file cannot be written.
    """
    answers, utterances = asked_in(evaluation)
    result = evaluation.result
    columns = zip(
        result.success.tolist(),
        result.outcome.tolist(),
        result.lengths.tolist(),
        result.returns.tolist(),
        utterances,
        strict=True,
    )
    episodes = (
        (number, int(success), result.names[outcome], length, f"{total:.6g}", said)
        for number, (success, outcome, length, total, said) in enumerate(columns)
    )
    head = ("episode", "success", "outcome", "length", "return", "utterances")
    write_text(folder / EPISODES, _csv([head, *episodes]))
    asked = ((number, *one) for number, some in enumerate(answers) for one in some)
    write_text(folder / ASKED, _csv([("episode", *Answer._fields), *asked]))


def _csv(rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
