"""The stage of a training agent in words, from the rates at which rules fire and episodes end."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from socialai_dsl.checking.loaded import Loaded, LoadedSuite
from socialai_dsl.traces.endings import Ending

_UTTERANCES_SHOWN: Final = 2


class Learnt:
    """Puts the figures of an update into a sentence a newcomer can follow."""

    def __init__(self, loaded: Loaded, endings: Sequence[Ending]) -> None:
        """Speak of this scenario, whose episodes end so."""
        self._endings = endings
        frames = () if isinstance(loaded, LoadedSuite) else loaded.checked.frames
        self._heard = {
            rule.name: (frame.member, rule.hears[0].text)
            for frame in frames
            for rule in frame.rules
            if len(rule.hears) == 1
        }
        """Rule -> the member whose it is, and the one utterance that it waits for."""

    def sentence(self, row: Mapping[str, Any]) -> str:
        """The events of an update's episodes, in a sentence.

        Args:
            row: its figures, as `metrics.jsonl` has them.
        """
        if row.get("led") == 1:
            return f"watching the script: would do the same in {row['agreement']:.0%} of its steps"
        if row.get("led"):
            return "taking over from the script"
        parts = [part for part in (self._answers(row["rules"]), self._ends(row["outcomes"])) if part]
        return "; ".join(parts)

    def _answers(self, rules: Mapping[str, float | None]) -> str:
        """Which utterances were answered by whom, how often an episode, the most frequent first."""
        answers: dict[str, dict[str, float]] = {}
        for name, rate in rules.items():
            if rate and name in self._heard:
                who, heard = self._heard[name]
                by_whom = answers.setdefault(heard, {})
                by_whom[who] = by_whom.get(who, 0.0) + rate
        often = sorted(answers.items(), key=lambda answer: -sum(answer[1].values()))[:_UTTERANCES_SHOWN]
        parts = (
            f'"{heard}" is answered by '
            + ", ".join(f"{who} {rate:.2f}" for who, rate in by_whom.items())
            + " times"
            for heard, by_whom in often
        )
        return "per episode " + ", ".join(parts) if often else ""

    def _ends(self, outcomes: Mapping[str, float | None]) -> str:
        """How the episodes ended."""
        shares = {"success": 0.0, "failure": 0.0, "out of time": 0.0}
        for ending in self._endings:
            is_timeout = ending.name.rpartition(": ")[2] == "timeout"
            kind = "success" if ending.success else "out of time" if is_timeout else "failure"
            shares[kind] += outcomes.get(ending.name) or 0.0
        return (
            ", ".join(f"{kind} {share:.0%}" for kind, share in shares.items()) if sum(shares.values()) else ""
        )
