"""Write docs/gallery.md, every shipped scenario with a picture and how hard it is: `make gallery`."""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from socialai_dsl.atomic import read_json, write_json, write_text
from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone
from socialai_dsl.loader.shipped import catalogue
from tools.sheets import MEASURED, alike, measure, sheeted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SUMMARY: Final = (
    "write the gallery of the shipped scenarios, its pictures, or pages on which its episodes play"
)

_ROOT: Final = Path(__file__).parents[1]
DOCS: Final = _ROOT / "docs"
_PAGE: Final = "gallery.md"
_SHEETS: Final = "scenarios"
_OWN: Final = "gallery"
"""The folder with pictures and figures of scenarios without a data sheet."""
_EPISODES: Final = (0, 1, 2)
"""The test episodes that can be watched."""


class Line(NamedTuple):
    """A line of the gallery.

    Attributes:
        shown: what its picture, its figures and its episodes are of, as `load` takes it.
        others: shipped scenarios that differ from it in a part, or in who plays which role.
    """

    shown: str
    others: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The shipped scenario that is shown, without its variant."""
        return self.shown.partition("+")[0]

    @property
    def file(self) -> str:
        """What its files are called, without an ending."""
        return self.shown.replace("+", "_")


_SCHOOL: Final = (
    Line("school/boxes+color"),
    Line("school/switches+color"),
    Line("school/generators+color"),
    Line("school/marbles+color", ("school/marbles_alone",)),
    Line("school/doors+color", ("school/doors_alone",)),
    Line("school/levers+color"),
    Line("school/lever_door", ("school/lever_door_swapped",)),
    Line("school/marble_push", ("school/marble_push_swapped",)),
    Line("school/marble_pass", ("school/marble_pass_swapped", "school/marble_pass_asocial")),
    Line("school/color_match", ("school/color_match_swapped",)),
    *(
        Line(f"school/color_match_{things}", (f"school/color_match_{things}_swapped",))
        for things in ("generators", "marbles", "switches")
    ),
    Line("school/apple_stealing", ("school/apple_stealing_asocial",)),
)
SUITES: Final = (
    "school/information_seeking",
    "school/information_seeking_asocial",
    "school/collaboration",
    "school/collaboration_in_turn",
    "school/role_reversal",
    "school/apple_stealing_suite",
)

_OF_FOLDER: Final = {
    "classics": (
        "Classic experiments",
        "[What each experiment tests, and how it was measured](classics.md).",
    ),
    "novel": ("New tasks", "[How agents were trained on them](mastery.md#school-and-novel-scenarios)."),
    "together": (
        "Several players",
        "Chance plays the agent's seat beside the scripts of the others; the agents were trained on all seats at once "
        "([what self-play finds](together.md)).",
    ),
}


AGENTS: Final[dict[str, tuple[str, str]]] = {
    **{
        f"classics/{name}": (figure, "classics.md#what-was-measured")
        for name, figure in {
            "director_task": "99.0",
            "gaze_barriers": "100.0",
            "ice_cream_van": "96.6",
            "mutual_exclusivity": "65.2",
            "selective_trust": "51.2",
            "over_imitation": "100.0",
            "social_referencing": "99.8",
            "helper_hinderer": "96.8",
            "discrepant_desires": "53.2",
            "ultimatum": "100.0",
            "joint_commitment": "100.0",
            "story_in_turns": "89.6",
        }.items()
    },
    **{
        name: (figure, "mastery.md#school-and-novel-scenarios")
        for name, figure in {
            "novel/bargaining": "1.000",
            "novel/haggling": "1.000",
            "novel/interpreter": "1.000",
            "novel/sally_anne": "1.000",
            "novel/second_order": "1.000",
            "novel/shop": "1.000",
            "novel/turn_taking": "1.000",
            "novel/whisper": ".998",
            "novel/gaze_following": ".990",
            "novel/fetch": ".976",
            "novel/implicature": ".870",
            "novel/reference_game": ".746",
            "novel/culprit": ".602",
            "novel/gossip": ".502",
            "novel/sarcasm": ".488",
            "novel/conventions": ".112",
            "school/boxes+color": ".996",
            "school/switches+color": ".972",
            "school/generators+color": ".984",
            "school/marbles+color": ".548",
            "school/doors+color": ".998",
            "school/levers+color": ".992",
            "school/lever_door": ".986",
            "school/marble_push": ".994",
            "school/marble_pass": "1.000",
            "school/color_match": ".492",
            "school/color_match_generators": ".506",
            "school/color_match_marbles": ".452",
            "school/color_match_switches": ".496",
            "school/apple_stealing": ".806",
        }.items()
    },
    **{
        f"together/{name}": (figure, "together.md#success-with-themselves")
        for name, figure in {
            "reference_game_together": "1.000",
            "levers_together": ".998",
            "turn_taking_together": "1.000",
            "help_together": ".976",
            "conventions_together": ".986",
        }.items()
    },
}
"""What is shown -> a trained agent's success as a page states it, and the place there; others are in `agents/`."""


RELATIONS: Final = {
    "novel/reference_game": "1.000",
    "novel/sarcasm": ".996",
    "novel/implicature": ".960",
    "school/color_match": ".956",
    "novel/conventions": ".602",
}
"""What is shown -> success with the network `relations`, as `docs/mastery.md` has it, where it changes the verdict."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "--measure", action="store_true", help="play chance and scripts where no data sheet has them"
    )
    parser.add_argument(
        "--replays", type=Path, metavar="FOLDER", help="write the pages that play, and nothing else"
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Write the replays, or the page and its pictures."""
    if arguments.replays is not None:
        write_replays(arguments.replays, lines())
        return Exit.GOOD
    if arguments.measure:
        own = [line.shown for line in lines() if line.shown not in sheeted()]
        write_json(DOCS / _OWN / MEASURED, {shown: measure(shown) for shown in sorted(own)})
    for place, drawn in pictures().items():
        if not alike(place, drawn):
            _save(place, drawn)
    write_text(DOCS / _PAGE, page())
    return Exit.GOOD


def _save(place: Path, drawn: "NDArray[np.uint8]") -> None:
    from PIL import Image

    place.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(drawn).quantize(64).save(place, optimize=True)


def lines() -> Iterator[Line]:
    """Every line of the gallery, suites apart."""
    for _, _, group in _groups():
        yield from group


def listed() -> set[str]:
    """The shipped scenarios that the gallery names."""
    return {name for line in lines() for name in (line.name, *line.others)} | set(SUITES)


def pictures() -> "dict[Path, NDArray[np.uint8]]":
    """The pictures of scenarios without a data sheet, by file."""
    import socialai_dsl
    from tools.sheets_picture import picture

    own = [line for line in lines() if line.shown not in sheeted()]
    return {DOCS / _picture(line): picture(socialai_dsl.load(line.shown)) for line in own}


def write_replays(folder: Path, of: Iterable[Line]) -> None:
    """A page for each line, on which the script's episodes play; the shipped agent's where there is no script."""
    import socialai_dsl
    from socialai_dsl.episodes.scripts import script_of

    for line in of:
        place = folder / f"{line.file}.html"
        place.parent.mkdir(parents=True, exist_ok=True)
        agent = "shipped" if script_of(line.shown) is None else "oracle"
        socialai_dsl.replay(line.shown, place, agent=agent, test_episodes=_EPISODES)


def page() -> str:
    """The gallery."""
    about = {one.name: one.about for one in catalogue()}
    measured = {**read_json(DOCS / _SHEETS / MEASURED), **read_json(DOCS / _OWN / MEASURED)}
    parts = [_TOP]
    for title, remark, group in _groups():
        parts += [f"## {title}", remark] if remark else [f"## {title}"]
        rows = [_row(line, about, measured.get(line.shown, {})) for line in group]
        parts.append("\n".join(["| | |", "|---|---|", *rows]))
    suites = [f"* `{name}`: {about[name]}" for name in SUITES]
    parts += ["Suites of these problems, with held-out combinations:", "\n".join(suites), _END]
    return "\n\n".join(parts) + "\n"


_TOP: Final = """\
# Gallery

<!-- Written by `make gallery`; change tools/gallery.py or a scenario's file and run it again. -->

Every scenario that ships. *Watch* plays three episodes of the scenario's script in your browser, with the reason of
each rule. `make docs` writes these pages beside this one.

Figures are success in per cent of episodes. **Chance** acts at random, the **rival** is the best of the strategies that
[lack the skill](checks.md#rivals), the **script** is the scenario's own, and the **agent** learnt from demonstrations
by the script. An agent's figure links to its conditions, that of chance to the data sheet.
[Names and variants](#names-and-variants) explains names such as `school/boxes+color`."""

_END: Final = """\
## Names and variants

A name includes the folder, as in `classics/director_task`. `socialai list` has every name with its variants and
parameters.

| variant | what it changes |
|---|---|
| `+oracle` | the agent follows the script, which shows that the scenario can be solved; all but the suites have it |
| `+unsocial` | the agent neither sees nor hears the others |
| `+marked` | tokens in the dialogue say who speaks |
| `+seats` | every member of the cast [can be played](partners.md#the-other-side-of-a-scenario) |
| `+alike` | as `+seats`, and a player's picture does not show which seat it has |
| `+as_coded` | the scenario as in the code released with the paper; those of the paper have it |

`social_env?split=test` has a role that never occurs in training. In the School, the caretaker shows which thing is
right in five ways: `school/boxes+pointing`, `+color`, `+feedback`, `+emulation` and `+scaffolding`.
`school/boxes+alone` has no distractor, `+asocial` no caretaker, `+asocial+alone` neither; `doors_alone` and
`marbles_alone` are separate files. In `school/lever_door_swapped` the agent takes the other role.

The scenarios of the paper, the classics and those of several players have [data sheets](scenarios/README.md) with
pictures, skills and figures.

```{toctree}
:hidden:
:glob:

classics
scenarios/README
scenarios/*
scenarios/classics/*
scenarios/together/*
```"""


def _groups() -> Iterator[tuple[str, str, Sequence[Line]]]:
    """Title, remark and lines of each part."""
    names = [one.name for one in catalogue()]
    yield "Tasks of the SocialAI 1.0 paper", "", [Line(name) for name in names if "/" not in name]
    for folder, (title, remark) in _OF_FOLDER.items():
        yield title, remark, [Line(name) for name in names if name.startswith(f"{folder}/")]
    yield (
        "The SocialAI School",
        "Where one of two things is right, the caretaker names its colour. This is one of "
        "[five cues](#names-and-variants); without a cue, the agent can only guess.",
        _SCHOOL,
    )


def _row(line: Line, about: Mapping[str, str], measured: Mapping[str, Any]) -> str:
    others = f" Also {', '.join(f'`{name}`' for name in line.others)}." if line.others else ""
    watch = f'<a href="replays/{line.file}.html">Watch</a>'
    text = f"**`{line.shown}`** {about[line.name]}{others}<br>{_figures(line, measured)}<br>{watch}"
    return f"| ![{line.shown}]({_picture(line)}) | {text} |"


def _picture(line: Line) -> str:
    return f"{_SHEETS if line.shown in sheeted() else _OWN}/{line.file}.png"


def _figures(line: Line, measured: Mapping[str, Any]) -> str:
    """How hard it is: chance, rival, script and agent, as far as they are known."""
    sheet = f"[%s]({_SHEETS}/{line.file}.md)" if line.shown in sheeted() else "%s"
    found = []
    if "random" in measured:
        found.append(f"chance {sheet % _per_cent(measured['random']['success_rate'])}")
    if rivals := measured.get("rivals"):
        best = max(rivals, key=lambda name: rivals[name]["success_rate"])
        found.append(f"rival `{best}` {_per_cent(rivals[best]['success_rate'])}")
    if "oracle" in measured:
        found.append(f"script {_per_cent(measured['oracle']['success_rate'])}")
    result = _ROOT / "agents" / line.shown / "result.json"
    if result.is_file():
        rate = read_json(result)["eval"]["success_rate"]
        found.append(f"agent [{_per_cent(rate)}](trained_agents.md#agents-that-ship)")
    elif line.shown in AGENTS:
        figure, place = AGENTS[line.shown]
        share = float(figure) / (100 if place.startswith("classics") else 1)
        found.append(f"agent [{_per_cent(share)}]({place})")
    if line.shown in RELATIONS:
        found[-1] += f", with [`relations`](agents.md#relations) {_per_cent(float(RELATIONS[line.shown]))}"
    return " · ".join(found)


def _per_cent(share: float) -> str:
    return f"{100 * share:.1f}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m tools.gallery", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
