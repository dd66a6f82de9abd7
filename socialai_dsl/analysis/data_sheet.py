"""The data sheet of a scenario: what its file says, in tables, and what was measured."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from socialai_dsl.analysis.sheet_text import code, entries, flow, frame, items, rule, table
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.compilation import compile_loaded
from socialai_dsl.loader.reader import display_name
from socialai_dsl.loader.shipped import IDS, base_of, file_of, is_shipped, variants_of
from socialai_dsl.program import Header
from socialai_dsl.program_suite import ProgramSuite, channels_of
from socialai_dsl.semantics.cast import AGENT, Member, fillings, members
from socialai_dsl.semantics.scope import Symbols

_GENERATED: Final = "<!-- Written by `make sheets`; change the scenario's file and run it again. -->"
_MEMBERS_SHOWN: Final = 40
_FILES: Final = "../../scenarios"
_DEFAULTS: Final = {"kind": "peer", "place": "anywhere", "facing": "random", "color": "random"}


def sheet(name: str, loaded: Loaded) -> str:
    """The data sheet of any scenario or suite as Markdown, without pictures and measurements.

    Args:
        name: a path or a name, as `load` takes it.
        loaded: the same, loaded.
    """
    data = _data(loaded)
    about = _about(name, data) if is_shipped(name) else str(data.get("about", ""))
    lines = [f"# {name}", "", about, ""] if about else [f"# {name}", ""]
    return _sheet(lines, name, loaded)


def page(name: str, loaded: Loaded, measured: Mapping[str, Any] | None) -> str:
    """The sheet of a shipped scenario or suite as a page of the documentation.

    Args:
        name: as it is shipped.
        loaded: the scenario.
        measured: its entry among the measurements; None if there is none.
    """
    lines = [f"# {name}", "", _GENERATED, "", _about(name, _data(loaded)), ""]
    *folders, own = name.split("/")
    lines += [f"![rooms of {name} at the start of an episode]({own}.png)", ""]
    lines += [
        "The arrow is the agent; what it sees is outlined. An NPC's dark triangle shows where it looks.",
        "",
    ]
    return _sheet(lines, name, loaded, measured, "../" * len(folders) + f"{_FILES}/{name}.yaml")


def _sheet(
    lines: list[str], name: str, loaded: Loaded, measured: Mapping[str, Any] | None = None, link: str = ""
) -> str:
    data = _data(loaded)
    lines += [*_facts(name, loaded, data, link), ""]
    body = _suite(loaded, bool(link)) if isinstance(loaded, LoadedSuite) else _scenario(loaded, data)
    ships = (
        (_variants(name), _measured(measured), _dilemmas(name, measured), _as_coded(name))
        if is_shipped(name)
        else ()
    )
    for section in (*body, *ships):
        if section:
            lines += [*section, ""]
    return "\n".join(lines).rstrip() + "\n"


def index(rows: Mapping[str, tuple[Loaded, Mapping[str, Any] | None]]) -> str:
    """The list of all sheets as Markdown: name -> scenario and measurements."""
    cells = []
    for name, (loaded, measured) in rows.items():
        data = _data(loaded)
        random, script = (measured or {}).get("random"), (measured or {}).get("oracle")
        cells.append(
            (
                f"[{name}]({name}.md)",
                _about(name, data),
                _share(random),
                _share(script),
                f"{script['ceiling']:.2%}" if script else "",
            )
        )
    head = ["# The shipped scenarios", "", _GENERATED, ""]
    columns = ("scenario", "what it is about", "random policy", "own script", "ceiling")
    foot = ["", "[Fidelity](../fidelity.md) compares them with the paper's code."]
    if any(measured for _, measured in rows.values()):
        foot[1:1] = [
            "Success of the random policy and of each scenario's own script; the ceiling",
            "is the share of rooms that can be solved at all.",
        ]
    return "\n".join([*head, *table(columns, cells), *foot]) + "\n"


def _data(loaded: Loaded) -> dict[str, Any]:
    data = loaded.resolved.data
    assert isinstance(data, dict), "internal: a file is a mapping"
    return data


# --- what all have


def _about(name: str, data: Mapping[str, Any]) -> str:
    """What a scenario says it is about; a variant that does not say it says what it changes."""
    about, base = str(data.get("about", "")), base_of(name)
    if not base:
        return about
    changes = _first_comment(file_of(name))
    return f"{changes[:1].upper()}{changes[1:]}. A variant of [{base}]({base}.md): {about}"


def _reward(slope: int, each_step: int) -> str:
    """The reward, from thousandths that are lost by the horizon and millionths for every step."""
    also = f", and {each_step / 1e6:g} in every step" if each_step else ""
    return f"1 - {slope / 1000:g} t / horizon for a success in step t, else 0{also}"


def _facts(name: str, loaded: Loaded, data: Mapping[str, Any], link: str) -> list[str]:
    playable = compile_loaded(loaded)
    programs = playable.programs if isinstance(playable, ProgramSuite) else (playable,)
    slots = playable.sentences.slots
    sizes = [len(playable.actions) + 1, 2, len(playable.templates), *(len(slot.words) for slot in slots)]
    tokens = max(program.header(Header.TOKENS) for program in programs)
    ids = [f"`SocialAI/{gym}-v1`" for gym, scenario in IDS.items() if scenario == name]
    horizons = sorted({program.header(Header.HORIZON) for program in programs})
    rewards = sorted(
        {(one.header(Header.SLOPE), one.header(Header.EACH_STEP)) for one in programs}, reverse=True
    )
    skills = data.get("skills") or []
    rows = [
        ("file", f"[`scenarios/{name}.yaml`]({link})" if link else code(display_name(loaded.resolved.path))),
        ("Gymnasium", ", ".join(ids)),
        ("skills", ", ".join(skills if isinstance(skills, list) else [skills]).replace("_", " ")),
        ("horizon", " or ".join(map(str, horizons)) + " steps"),
        ("reward", " or ".join(_reward(*numbers) for numbers in rewards)),
        ("action", f"{sizes}: body, speak or not, template, {', '.join(slot.name for slot in slots)}"),
        (
            "observation",
            f"image 7 x 7 x {len(channels_of(programs))} and {tokens} tokens of {len(playable.vocabulary)} words",
        ),
        ("body actions", ", ".join([*playable.actions, "none"])),
    ]
    if not isinstance(playable, ProgramSuite):
        rows.append(("earshot", code(data.get("earshot", "next_to"))))
        rows.append(("results by", flow(data["results_by"]) if "results_by" in data else ""))
    rows.append(("observed", entries(data.get("observe") or {})))
    return ["| | |", "|---|---|", *(f"| {key} | {value} |" for key, value in rows if value)]


def _variants(name: str) -> list[str]:
    lines = [
        f"* {code(f'{name}+{variant}')}: {_first_comment(file_of(name, variant))}"
        for variant in variants_of(name)
    ]
    return ["## Variants", "", *lines] if lines else []


def _as_coded(name: str) -> list[str]:
    """What the code of the paper does otherwise: the variant itself, since every line of it is one difference."""
    if "/" in name or "as_coded" not in variants_of(name):  # nothing in a folder is of the paper
        return []
    text = file_of(name, "as_coded").read_text(encoding="utf-8").rstrip()
    return ["## Paper and code", "", "The scenario follows the paper's text. Its code differs in this:", "",
            "```yaml", text, "```"]  # fmt: skip


def _first_comment(path: Path) -> str:
    first = path.read_text(encoding="utf-8").splitlines()[0]
    return first.partition("#")[2].strip()


def _measured(measured: Mapping[str, Any] | None) -> list[str]:
    if measured is None:
        return []
    rows = []
    if random := measured.get("random"):
        length = f"{random['mean_length']:.2f} steps an episode"
        rows.append(("random policy", _share(random), length, f"{random['episodes']:,} episodes"))
    if script := measured.get("oracle"):
        length = f"{script['mean_length']:.1f} steps a success"
        rows.append(("own script", _share(script), length, f"{script['rooms']:,} rooms"))
        rows += _rows_apart(script)
    for name, rival in measured.get("rivals", {}).items():
        rows.append((f"rival {code(name)}", _share(rival), "", f"{rival['rooms']:,} rooms"))
        rows += _rows_apart(rival)
    lines = ["## Measured", "", *table(("who", "success", "length", "of"), rows)]
    if script and (counts := {v: n for v, n in script["unsolved"].items() if n}):
        found = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        lines += ["", f"Rooms that the script does not solve were searched: {found}. No policy succeeds in more than "
                  f"{script['ceiling']:.2%} of these rooms."]  # fmt: skip
    return lines


def _dilemmas(name: str, measured: Mapping[str, Any] | None) -> list[str]:
    """What is paid to those who cooperate and to those who defect, as a picture and in a table."""
    lines: list[str] = []
    for picture, found in zip(
        dilemma_pictures(name, measured), (measured or {}).get("dilemmas", ()), strict=True
    ):
        cooperate, defect = found["frames"]
        columns = ("others who cooperate", f"to cooperate, {code(cooperate)}", f"to defect, {code(defect)}")
        paid = zip(found["cooperators"], found["defectors"], strict=True)
        rows = [(str(others), f"{one:.3f}", f"{other:.3f}") for others, (one, other) in enumerate(paid)]
        lines += [
            "",
            f"It is {found['verdict']}.",
            "",
            f"![what each is paid, by how many others cooperate]({picture})",
        ]
        lines += ["", *table(columns, rows)]
    return ["## Dilemma", *lines] if lines else []


def dilemma_pictures(name: str, measured: Mapping[str, Any] | None) -> list[str]:
    """The names of the pictures of a scenario's dilemmas, beside its sheet."""
    count, own = len((measured or {}).get("dilemmas", ())), name.rpartition("/")[2]
    return [f"{own}_dilemma{number if count > 1 else ''}.png" for number in range(1, count + 1)]


def _rows_apart(figures: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """A row for each value of the draws by which results are told apart."""
    return [
        (f"… with {code(f'{draw}: {value}')}", _share(part), "", f"{part['rooms']:,} rooms")
        for draw, values in figures.get("results_by", {}).items()
        for value, part in values.items()
    ]


def _share(figures: Mapping[str, Any] | None) -> str:
    return f"{figures['success_rate']:.2%} ± {figures['success_rate_se']:.2%}" if figures else ""


# --- suites


def _suite(loaded: LoadedSuite, linked: bool) -> Iterator[list[str]]:
    data = _data(loaded)
    names = loaded.member_names
    plays = "all of them, one after another" if loaded.in_sequence else "one of them"
    if not loaded.in_sequence and len(set(loaded.weights)) == 1:
        plays += ", all with the same probability"
    members = [f"* [{name}]({name}.md)" if linked else f"* {code(name)}" for name in names[:_MEMBERS_SHOWN]]
    more = len(names) - _MEMBERS_SHOWN
    members += [f"* and {more} more"] if more > 0 else []
    yield ["## Members", "", f"Each episode plays {plays}.", "", *members]
    yield [
        "## Grammar",
        "",
        f"{code(flow(data.get('grammar', 'union')))}; {code('actions: ' + flow(data.get('actions', 'union')))}",
    ]
    if splits := data.get("splits"):
        yield ["## Splits", "", *items(splits)]
    if notes := data.get("notes"):
        yield ["## Notes", "", str(notes).strip()]


# --- scenarios


def _scenario(loaded: LoadedScenario, data: Mapping[str, Any]) -> Iterator[list[str]]:
    if notes := data.get("notes"):
        yield ["## Notes", "", str(notes).strip()]
    grammar = loaded.scenario.grammar
    words = grammar.nouns or [f"{name}: {', '.join(map(str, can))}" for name, can in grammar.slots.items()]
    yield ["## What can be said", "",
           f"{len(grammar.templates)} templates with {len(words)} {'nouns' if grammar.nouns else 'slots'}:", "",
           "* " + " · ".join(map(code, grammar.templates)), "* " + " · ".join(map(code, words))]  # fmt: skip
    yield ["## Room", "", *items(data["room"])]
    yield ["## Cast", "", *_cast(loaded)]
    if objects := data.get("objects"):
        yield [
            "## Objects",
            "",
            *table(
                ("what", "type", "where", "colour", "more"), map(_object, *zip(*objects.items(), strict=True))
            ),
        ]
    for key, title in (
        ("let", "Drawn once per episode"),
        ("define", "Defined"),
        ("memory", "Memory"),
        ("params", "Parameters"),
    ):
        if data.get(key):
            yield [f"## {title}", "", *items(data[key])]
    frames = _frames(loaded, data)
    if frames:
        yield ["## Frames", "", *frames]
    if rules := data.get("rules"):
        yield [
            "## Rules of the world",
            "",
            *(f"* {rule(one)}" for one in (rules if isinstance(rules, list) else [rules])),
        ]
    yield ["## Outcome", "", "The first that holds ends the episode:", "", *_outcomes(data)]
    if figures := loaded.scenario.published:
        rows = [(one.who, one.did, f"{one.share:.0%}", str(one.n), one.source) for one in figures]
        yield ["## Published", "", *table(("who", "what they did", "share", "of", "source"), rows)]


def _cast(loaded: LoadedScenario) -> list[str]:
    columns = ("who", "role", "seat", "kind", "name", "where", "facing", "colour", "view", "frame", "with")
    rows, drawn = [], []
    for key, member in members(loaded.scenario).items():
        shared = any(one.seat for one in loaded.scenario.cast.values())
        rows.append(_member(member, loaded.scenario.cast[key].role or "", shared))
        if member.drawn is not None:
            rows[-1] = (*rows[-1][:3], "one of the below", "", *rows[-1][5:10], "")
            drawn += ["", f"{code(key)} is one of these, drawn for each episode:", ""]
            raws = [{key: str(one.raw) for key, one in version.items()} for version in member.versions]
            drawn += table(
                ("which", "kind", "name", "with"),
                [
                    (code(one["npc"]), one.get("kind", ""), one.get("name", ""), entries(fillings(version)))
                    for one, version in zip(raws, member.versions, strict=True)
                ],
            )
    return [*table(columns, rows), *drawn]


def _member(member: Member, role: str, shared: bool) -> tuple[str, ...]:
    """A row of the cast; `shared`: others than the agent have a seat, so that they see and hear it."""

    def given(key: str, default: str = "") -> str:
        return " or ".join(dict.fromkeys(code(case.raw or default) for case in member.cases(key)))

    spots = (case.raw or _DEFAULTS["place"] for case in member.cases("at", "place"))
    cells = [f"[{', '.join(map(str, spot))}]" if isinstance(spot, tuple) else spot for spot in spots]
    agent = member.key == AGENT and not shared
    return (
        code(member.key),
        role,
        "open" if shared and (member.key == AGENT or member.value("seat")) else "",
        "" if agent else str(member.value("kind") or _DEFAULTS["kind"]),
        "" if agent else given("name", Symbols.default_name(member.key)),
        " or ".join(map(code, cells)),
        given("facing", _DEFAULTS["facing"]),
        "" if agent else given("color", _DEFAULTS["color"]),
        str(member.value("view") or ""),
        code(member.value("frame") or ""),
        entries(fillings(member.versions[0])),
    )


def _object(name: str, content: Mapping[str, Any]) -> tuple[str, ...]:
    where = flow(content["at"]) if "at" in content else flow(content.get("place", "anywhere"))
    count = f" ({content['count']})" if "count" in content else ""
    more = entries(content, ("type", "count", "place", "at", "color"))
    return code(name) + count, str(content["type"]), code(where), code(flow(content.get("color", ""))), more


def _frames(loaded: LoadedScenario, data: Mapping[str, Any]) -> list[str]:
    """The frames of the file, then those of the files that a cast member is drawn from, each once."""
    frames = dict(data.get("frames") or {})
    for member in loaded.scenario.cast.values():
        for file in member.one_of or ():
            for name, content in file.frames.items():
                frames.setdefault(name, content.model_dump(by_alias=True, exclude_unset=True, mode="json"))
    lines: list[str] = []
    for name, content in frames.items():
        lines += [*frame(name, content), ""]
    return lines[:-1]


def _outcomes(data: Mapping[str, Any]) -> Iterator[str]:
    outcomes = data["outcome"] if isinstance(data["outcome"], list) else [data["outcome"]]
    for number, one in enumerate(outcomes, 1):
        kind = "success" if "success" in one else "failure"
        more = entries(one, ("success", "failure"))
        yield f"{number}. {kind}: {code(one[kind])}" + (f" ({more})" if more else "")
