"""The episodes that a mind played, one by one, and the answers that it got: one form for every kind of mind."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pandas as pd

from socialai_dsl.runs.folder import ASKED, EPISODES

EPISODE_COLUMNS: Final = ("episode", "room", "trial", "cluster", "success", "outcome", "steps", "utterances")
"""Number in the run, room of the test set, place in the session from 1, what it has in common with others by chance (a
session, a person, those who play together), success 0 or 1, ending, steps, and how often the player spoke."""

ANSWER_COLUMNS: Final = ("episode", "step", "said", "by", "answer")
"""The episode, the step of the question, its words, who answered, and what."""

REACTION_COLUMNS: Final = ("trial", "ms")
"""The trial, and milliseconds from a picture to the act, by the clock of a person's page."""

NO_EPISODES: Final = pd.DataFrame(columns=list(EPISODE_COLUMNS))
NO_ANSWERS: Final = pd.DataFrame(columns=list(ANSWER_COLUMNS))
NO_REACTIONS: Final = pd.DataFrame(columns=list(REACTION_COLUMNS))


def table_of(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> pd.DataFrame:
    """A table of these columns."""
    return pd.DataFrame(list(rows), columns=list(columns))


def read_episodes(folder: Path, trials: int, session: int, problems: list[str]) -> pd.DataFrame:
    """The test episodes that a run lists, in `EPISODE_COLUMNS`; none where it lists none.

    Args:
        folder: of the run.
        trials: how many episodes in a row its player remembered.
        session: how many in a row may be alike.
        problems: gets what is wrong with the list, in words.
    """

    def made(table: pd.DataFrame) -> pd.DataFrame:
        if not (table.success.isin([0, 1]).all() and table.episode.is_unique):
            raise ValueError
        known = table.reindex(columns=["outcome", "length", "utterances"])  # older lists lack some
        return pd.DataFrame(
            {
                "episode": table.episode,
                "room": table.episode,
                "trial": table.episode % trials + 1,
                "cluster": (table.episode // session).astype(str),
                "success": table.success,
                "outcome": known.outcome,
                "steps": pd.to_numeric(known.length),
                "utterances": pd.to_numeric(known.utterances),
            }
        )

    types = {"episode": int, "success": int, "outcome": str}
    return _read(folder / EPISODES, types, made, NO_EPISODES, problems)


def read_answers(folder: Path, problems: list[str]) -> pd.DataFrame:
    """The answers that a run lists, in `ANSWER_COLUMNS`; none where it lists none."""
    types = {"episode": int, "step": int, "said": str, "by": str, "answer": str}
    return _read(folder / ASKED, types, lambda table: table[list(ANSWER_COLUMNS)], NO_ANSWERS, problems)


def _read(
    path: Path,
    types: Mapping[str, Any],
    made: Callable[[pd.DataFrame], pd.DataFrame],
    nothing: pd.DataFrame,
    problems: list[str],
) -> pd.DataFrame:
    """A table of a run; `nothing` where there is none, or, with a problem, none that can be read."""
    try:
        table = pd.read_csv(path, dtype=dict(types), keep_default_na=False)
        return made(table)
    except FileNotFoundError:
        pass
    except OSError as error:
        problems.append(f"{path.name} cannot be read ({error.strerror})")
    except (ValueError, OverflowError, KeyError, AttributeError):  # among the first are all of the parser's
        problems.append(f"{path.name} is damaged")
    return nothing
