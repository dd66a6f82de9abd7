"""What an agent has learnt so far, in words, from the rates at which rules fire and episodes end."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from socialai_dsl.checking import Loaded, LoadedSuite
from socialai_dsl.cli.endings import Ending

_UTTERANCES_SHOWN: Final = 2
_WORDS: Final = re.compile(r"[^.\[\]]+")


class Learnt:
    """Puts the figures of an update into a sentence a newcomer can follow."""

    def __init__(self, loaded: Loaded, endings: Sequence[Ending]) -> None:
        """Speak of this scenario, whose episodes end so."""
        self._endings = endings
        data = loaded.resolved.data
        self._data: Mapping[str, Any] = (
            data if isinstance(data, dict) and not isinstance(loaded, LoadedSuite) else {}
        )

    def sentence(self, row: Mapping[str, Any]) -> str:
        """What happened in the episodes of an update.

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
            who = name.partition(".")[0]
            heard = self._heard(name, who) if rate else None
            if rate and heard:
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

    def _heard(self, rule: str, member: str) -> str | None:
        """The utterance that a rule of a member waits for; None if it waits for none, or for one of several."""
        _, *path = _WORDS.findall(rule)
        cast = self._data.get("cast", {}).get(member, {})
        frame = cast.get("frame") if isinstance(cast, dict) else None
        frames = self._data.get("frames", {})
        node: Any = frames.get(path[0]) if path and path[0] in frames else frame
        for step in path[1:]:
            if isinstance(node, dict) and "states" in node and step in node["states"]:
                node = node["states"][step]
            elif isinstance(node, dict):
                node = node.get(step)
            elif isinstance(node, list) and step.isdigit() and int(step) < len(node):
                node = node[int(step)]
            else:
                return None
        heard = node.get("hears") if isinstance(node, dict) else None
        return heard if isinstance(heard, str) else None

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
