"""The page of documentation with the comparisons to the paper's code."""

from collections.abc import Mapping
from typing import Final

from tools.fidelity_statistics import LEAST_P, LIMIT, Comparison

_HEAD: Final = """\
# Fidelity to the paper's code

The tables of the paper were measured on code. Where code and text of the paper differ, the scenarios follow the text
and their variant `as_coded` follows the code. This page compares `as_coded` with that code: in both, the same policy
plays, and the shares of successes and the lengths of episodes have to agree. The policy is the uniformly random one: it
draws the primitive from all primitives and "none", template and noun uniformly, and speaks with probability 1/2. It
knows nothing of any implementation and visits every corner a little: what ends an episode, how rooms are drawn, who
blocks whom and how often chance succeeds all show in these figures.

* **Theirs** was measured on the released SocialAI 1.0 code (20,000 episodes, 4,000 of ShowMe and of all *unsocial*
  runs, in which the others are neither seen nor heard). **Ours**: {episodes:,} episodes each, seed {seed},
  measured on {date} at commit {commit}.
* Every environment plays the same number of episodes and all of them count, so long episodes are not missed.
* **Success** is compared by Fisher's exact test, two-sided; p has to be at least {p}.
* **Length** is compared by the distance of the means in combined standard errors (of both sides, and of their rounding
  to two decimals); it has to be at most {limit}. Where their standard deviation is not known, ours is used for both.
* With these limits about one of a thousand comparisons of equal things fails by chance.

`make fidelity` measures all of it again, writes this page and fails if anything differs.
"""

_COLUMNS: Final = (
    "| scenario | success, theirs | ours | p | length, theirs (SD) | ours (SD) | distance "
    "| reward, theirs | ours | |\n|---|---|---|---|---|---|---|---|---|---|"
)


def page(compared: Mapping[str, Comparison], episodes: int, seed: int, date: str, commit: str) -> str:
    """The page as Markdown; comparisons by the name of what was played, measured on a date (ISO) at a commit."""
    head = _HEAD.format(
        episodes=episodes, seed=seed, date=date, commit=commit, p=f"{LEAST_P:g}", limit=f"{LIMIT:g}"
    )
    social = {name: c for name, c in compared.items() if not name.endswith("+unsocial")}
    unsocial = {name: c for name, c in compared.items() if name.endswith("+unsocial")}
    parts = [head]
    for title, group in (("With the others", social), ("Without the others (`+unsocial`)", unsocial)):
        if group:
            rows = [_row(name, comparison) for name, comparison in group.items()]
            parts.append("\n".join([f"## {title}\n", _COLUMNS, *rows]) + "\n")
    return "\n".join(parts)


def _row(name: str, comparison: Comparison) -> str:
    theirs, ours = comparison.published, comparison.ours
    rate = theirs.successes / theirs.episodes
    error = (rate * (1 - rate) / theirs.episodes) ** 0.5
    cells = [
        f"`{name}`",
        f"{rate:.5f} ± {error:.5f}",
        f"{ours.success_rate:.5f} ± {ours.success_se:.5f}",
        f"{comparison.p:.3g}",
        f"{theirs.mean_length:.2f}" + (f" ({theirs.sd_length:.2f})" if theirs.sd_length is not None else ""),
        f"{ours.mean_length:.3f} ({ours.sd_length:.2f})",
        f"{comparison.distance:+.2f}",
        "" if theirs.mean_reward is None else f"{theirs.mean_reward:.5f}",
        f"{ours.mean_reward:.5f}",
        "agrees" if comparison.agrees else "**differs**",
    ]
    return f"| {' | '.join(cells)} |"
