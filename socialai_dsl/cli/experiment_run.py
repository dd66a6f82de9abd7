"""`socialai experiment run`: works on an experiment's runs until all have ended."""

import contextlib
import json
import signal
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from socialai_dsl.cli.errors import Exit

if TYPE_CHECKING:
    from socialai_dsl.experiments.engines import Engine
    from socialai_dsl.experiments.folder import Run
    from socialai_dsl.experiments.work import Outcome


def work_on(
    folder: Path, document: Mapping[str, Any], runs: "Sequence[Run]", engine: "Engine", as_json: bool
) -> Exit:
    """Work on the runs that are left, and report their results.

    Raises:
        KeyboardInterrupt: somebody stopped it; all runs are left so that the same command goes on with them.
    """
    from socialai_dsl.cli.experiment_progress import RunsProgress
    from socialai_dsl.cli.experiment_tables import status_figures, status_text
    from socialai_dsl.experiments.driver import drive

    outcomes: Counter[str] = Counter()
    # With --json, standard output belongs to the result alone.
    stream = sys.stderr if as_json else sys.stdout
    with _stopped_by_signals(), RunsProgress(runs, stream) as shown:

        def ended(run: "Run", outcome: "Outcome", message: str) -> None:
            outcomes[outcome.value] += 1
            shown.ended(run, outcome.value, message)

        rounds = drive(folder, runs, engine, ended)
        try:
            for _ in rounds:
                shown.look()
        except KeyboardInterrupt:
            rounds.close()
            raise KeyboardInterrupt("stopped; the same command goes on from here") from None
    figures = status_figures(document, folder, runs)
    print(
        json.dumps(figures, indent=2, ensure_ascii=False)
        if as_json
        else "\n" + status_text(figures, each=False)
    )
    return Exit.GOOD if outcomes["failed"] == 0 else Exit.FINDINGS


@contextlib.contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM stop us as Ctrl-C does."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
