"""Checks a study's file: from its data to its pages and its design. `frontend` checks its scenarios."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from socialai_dsl.checking.experiments import from_anywhere
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, advice_on
from socialai_dsl.loader.reader import display_name, followed, is_file, read_source
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.shape import model_of
from socialai_dsl.schema.study import PERSON, WHO, Block, Question, Study
from socialai_dsl.semantics.study import Design, design_of
from socialai_dsl.source import DataPath
from socialai_dsl.trainer.shipped import PREFIX, shipped_agents

AGENT: Final = "agent"
PRACTICE: Final = -1
"""Stands for the number of a block where practice is meant."""

PICTURES: Final[Mapping[str, str]] = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".gif": "image/gif",
    ".webp": "image/webp",
}
"""The files that pages may show, by their endings, and what they are."""

PICTURE: Final = re.compile(r"!\[([^\]\n]*)\]\(([^()\s]+)\)")
"""A picture in Markdown."""


@dataclass(frozen=True)
class LoadedStudy:
    """A study that can be run.

    Attributes:
        study: the models. resolved: the data with its positions.
        design: which groups play which blocks in which rooms.
        consent, instructions: the pages, in Markdown. pictures: those that they show, name -> file.
        played: number of a block, or `PRACTICE` -> what is played there; where a script is to stand in for the agent,
            the scenario with that script.
    """

    study: Study
    resolved: ResolvedFile
    design: Design
    consent: str
    instructions: tuple[str, ...]
    pictures: Mapping[str, Path]
    played: Mapping[int, Loaded] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<LoadedStudy {self.study.study}: {len(self.study.blocks)} blocks>"

    @property
    def folder(self) -> Path:
        """Where relative paths of the file start."""
        return self.resolved.path.parent

    def named(self) -> Iterator[tuple[int, str, DataPath]]:
        """Each scenario: the number of its block, its name from anywhere, and where it is named."""
        if self.study.practice is not None:
            yield PRACTICE, from_anywhere(self.study.practice.scenario, self.folder), ("practice", "scenario")
        for number, block in enumerate(self.study.blocks):
            yield number, from_anywhere(block.scenario, self.folder), ("blocks", number, "scenario")


def seats_of(block: Block) -> dict[str, str]:
    """Who has the seats of a block that it speaks of; the agent's is a person's unless it says otherwise."""
    return {AGENT: PERSON} | dict(block.seats or {})


def persons_of(block: Block) -> tuple[str, ...]:
    """The seats of a block that people play, the agent's first, then in the order written."""
    return tuple(seat for seat, who in seats_of(block).items() if who == PERSON)


def scripts_agent(block: Block) -> bool:
    """Whether the agent of a block has to follow a script, now or when a person leaves."""
    several = len(persons_of(block)) > 1 and AGENT in persons_of(block)
    return seats_of(block)[AGENT] == "script" or (several and block.stands_in == "script")


def check_study(resolved: ResolvedFile, bag: DiagnosticBag) -> LoadedStudy | None:
    """A study with its pages and its design; None if they cannot be understood. `bag` takes the findings."""
    shaped = model_of(Study, resolved.tree, bag, parameters=False)
    if shaped.model is None:
        return None
    study, check = shaped.model, _Check(resolved, bag)
    pictures: dict[str, Path] = {}
    consent = check.page(study.consent, ("consent",), pictures)
    instructions = [
        check.page(page, ("instructions", number), pictures) for number, page in enumerate(study.instructions)
    ]
    check.questions(study)
    for number, block in enumerate(study.blocks):
        check.who(block, ("blocks", number, "seats"))
    design = design_of(study, shaped.tree, bag)
    check.participants(study, design)
    return LoadedStudy(study, resolved, design or Design((), ()), consent, tuple(instructions), pictures)


def check_seats(study: LoadedStudy, number: int, loaded: Loaded, bag: DiagnosticBag) -> bool:
    """Whether what is played in a block has the seats of it, with their scripts; `bag` says what it lacks."""
    known = len(bag)
    block, tree = study.study.blocks[number], study.resolved.tree
    names, scripted = _seats(loaded)
    for seat in block.seats or ():
        if seat not in names:
            span = tree.key_span(("blocks", number, "seats", seat))
            advice = advice_on(seat, names, "its seats are " + ", ".join(names))
            bag.error("S201", f"`{loaded.name}` has no seat `{seat}`", span, **advice)
    several = len(persons_of(block)) > 1
    for seat, who in (block.seats or {}).items():
        stands_in = several and who == PERSON and block.stands_in == "script"
        # What the agent follows may come from the variant `oracle`, which is looked for where it is played.
        if seat in names and seat != AGENT and (who == "script" or stands_in) and seat not in scripted:
            span = tree.value_span(("blocks", number, "seats", seat))
            hint = "`stands_in: random`, or `stands_in: nobody`" if stands_in else "one of " + ", ".join(WHO)
            bag.error("S704", f"there is no script for `{seat}` of `{loaded.name}`", span, hint=hint)
    return len(bag) == known


def _seats(loaded: Loaded) -> tuple[tuple[str, ...], frozenset[str]]:
    """The members of the cast with a seat, the agent's first, and those that follow a frame."""
    if isinstance(loaded, LoadedSuite):
        found = [_seats(member) for member in loaded.members]
        names = found[0][0] if len({names for names, _ in found}) == 1 else (AGENT,)
        return names, frozenset.intersection(*(scripted for _, scripted in found))
    assert isinstance(loaded, LoadedScenario), "internal: there is nothing else that can be played"
    checked = loaded.checked
    called = [e.key if e.index is None else f"{e.key}[{e.index}]" for e in checked.entities]
    names = (AGENT, *(called[number] for number in checked.seated))
    return names, frozenset(called[frame.entity] for frame in checked.frames)


class _Check:
    """Checks the parts of one file."""

    def __init__(self, resolved: ResolvedFile, bag: DiagnosticBag) -> None:
        self._tree, self._bag = resolved.tree, bag
        self._folder = resolved.path.parent

    def page(self, written: str, place: DataPath, pictures: dict[str, Path]) -> str:
        """The Markdown of a page; `pictures` gets those that it shows."""
        span = self._tree.value_span(place)
        text = written
        if "\n" not in written.strip() and written.strip().endswith(".md"):
            file = self._beside(written)
            if file is None:
                beside = sorted(path.name for path in self._folder.glob("*.md"))[:20]
                hint = "a file in the study's folder that ends in .md, or the text itself"
                message = f"there is no file `{written}` in {display_name(self._folder)}"
                self._bag.error("S903", message, span, **advice_on(written, beside, hint))
                return ""
            try:
                text = read_source(file).text
            except ScenarioError as error:
                self._bag.error("S903", f"`{written}`: {error.diagnostics[0].message}", span)
                return ""
        for _, name in PICTURE.findall(text):
            shown = self._beside(name)
            if shown is None or Path(name).suffix.lower() not in PICTURES:
                kinds = ", ".join(PICTURES)
                message = f"there is no picture `{name}` in {display_name(self._folder)}"
                self._bag.error(
                    "S903", message, span, hint=f"a file in the study's folder that ends in {kinds}"
                )
            else:
                pictures[name] = shown
        return text

    def _beside(self, name: str) -> Path | None:
        """A file in the study's folder; None if there is none, or if it lies elsewhere."""
        file = followed(self._folder / name)
        return file if file.is_relative_to(followed(self._folder)) and is_file(file) else None

    def questions(self, study: Study) -> None:
        """Report questions that cannot be answered, and names that two of them have."""
        everywhere = [(("questions",), study.questions)]
        everywhere += [(("blocks", n, "questions"), b.questions) for n, b in enumerate(study.blocks)]  # type: ignore[misc]
        known: set[str] = set()
        for place, questions in everywhere:
            for number, question in enumerate(questions):
                self._question(question, (*place, number))
                if question.id in known:
                    span = self._tree.value_span((*place, number, "id"))
                    self._bag.error("S213", f"there is another question `{question.id}`", span)
                known.add(question.id)

    def _question(self, question: Question, place: DataPath) -> None:
        needed = {"text": (), "choice": ("options",), "scale": ("from", "to")}[question.kind]
        given = {
            "options": question.options,
            "from": question.start,
            "to": question.to,
            "ends": question.ends,
        }
        for key in needed:
            if given[key] is None:
                message = f"a question of the kind `{question.kind}` needs a key `{key}`"
                self._bag.error("S105", message, self._tree.key_span(place))
        allowed = (*needed, "ends") if question.kind == "scale" else needed
        for key, value in given.items():
            if value is not None and key not in allowed:
                message = f"a question of the kind `{question.kind}` has no `{key}`"
                self._bag.error("S107", message, self._tree.key_span((*place, key)))
        if question.kind == "scale" and question.start is not None and question.to is not None:
            points = question.to - question.start + 1
            if not 2 <= points <= 101:
                message = f"a scale from {question.start} to {question.to} has no 2 to 101 points"
                self._bag.error("S106", message, self._tree.value_span((*place, "to")))
        for number, option in enumerate(question.options or ()):
            if option in (question.options or ())[:number]:
                span = self._tree.value_span((*place, "options", number))
                self._bag.error("S213", f"there is another option `{option}`", span)

    def who(self, block: Block, place: DataPath) -> None:
        """Report players that do not exist, and a block without a person."""
        shipped = [PREFIX + name for name in shipped_agents()]
        for seat, who in (block.seats or {}).items():
            if who in (*WHO, *shipped) or (self._folder / who).exists():
                continue
            hint = f"one of {', '.join(WHO)}, {PREFIX}NAME, or the path of a checkpoint or of a run's folder"
            message = f"there is no checkpoint `{who}` in {display_name(self._folder)}"
            span = self._tree.value_span((*place, seat))
            self._bag.error("S703", message, span, **advice_on(who, (*WHO, *shipped), hint))
        if not persons_of(block):
            message = "no seat of this block is a person's"
            hint = "give one of them `person`, or leave out who has the agent's"
            self._bag.error("S904", message, self._tree.key_span(place), hint=hint)

    def participants(self, study: Study, design: Design | None) -> None:
        """Warn of groups that cannot be filled alike."""
        if design is None or study.participants is None or study.participants % len(design.orders) == 0:
            return
        groups = len(design.orders)
        lower = study.participants - study.participants % groups
        hint = f"`participants: {lower + groups}`" + (f", or {lower}" if lower else "")
        message = f"{study.participants} participants do not fill {groups} groups alike"
        self._bag.warning("W905", message, self._tree.value_span(("participants",)), hint=hint)
