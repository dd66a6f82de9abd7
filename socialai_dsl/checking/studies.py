"""Checks a study's file: from its data to its pages and its design. `frontend` checks its scenarios."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from socialai_dsl.checking.experiments import from_anywhere, prices_from_anywhere
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite, session_of
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, advice_on
from socialai_dsl.errors import OptionError
from socialai_dsl.loader.prices import prices_of
from socialai_dsl.loader.reader import display_name, followed, is_file, read_source
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.schema.shape import model_of
from socialai_dsl.schema.study import PERSON, STANDING_IN, WHO, Block, Question, Study
from socialai_dsl.semantics.study import Design, design_of
from socialai_dsl.source import DataPath, Span
from socialai_dsl.trainer.config import MODEL_PREFIX, RIVAL_PREFIX
from socialai_dsl.trainer.shipped import PREFIX, shipped_agents

AGENT: Final = "agent"
SCRIPT: Final = "script"
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

_PICTURE: Final = re.compile(
    r"!\[[^\[\]]*\]\(\s*(?:<([^<>\n]+)>|((?:[^()<>\s]|\([^()\s]*\))+))"
    r"""(?:\s+(?:"[^"]*"|'[^']*'|\([^()]*\)))?\s*\)"""
)
"""A picture in Markdown: its name, in angle brackets if it has blanks, and perhaps a title."""


@dataclass(frozen=True)
class LoadedStudy:
    """A study that can be run.

    Attributes:
        study: the models. resolved: the data with its positions.
        design: which groups play which blocks in which rooms.
        consent, instructions: the pages, in Markdown. pictures: those that they show, name -> file.
        played: number of a block, or `PRACTICE` -> what is played there; where a script or a rival is to play the
            agent, the scenario with that frame.
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


def block_name(loaded: LoadedStudy, number: int) -> str:
    """What a block, or practice, is called in the data."""
    if number == PRACTICE:
        return "practice"
    return loaded.study.blocks[number].name or f"{loaded.played[number].name}_{number + 1}"


def check_block_names(loaded: LoadedStudy, bag: DiagnosticBag) -> None:
    """Report blocks that the data could not tell apart, or from practice."""
    known = {block_name(loaded, PRACTICE)}
    for number in loaded.played:
        if number == PRACTICE:
            continue
        name = block_name(loaded, number)
        if name in known:
            place = ("blocks", number, "name" if loaded.study.blocks[number].name else "scenario")
            hint = "give it another `name`"
            message = (
                f"`{name}` is the name of practice"
                if name == block_name(loaded, PRACTICE)
                else f"there is another block `{name}`"
            )
            bag.error("S213", message, loaded.resolved.tree.value_span(place), hint=hint)
        known.add(name)


def seats_of(block: Block) -> dict[str, str]:
    """Who has the seats of a block that it speaks of; the agent's is a person's unless it says otherwise."""
    return {AGENT: PERSON} | dict(block.seats or {})


def persons_of(block: Block) -> tuple[str, ...]:
    """The seats of a block that people play, the agent's first, then in the order written."""
    return tuple(seat for seat, who in seats_of(block).items() if who == PERSON)


def stand_ins_of(block: Block) -> dict[str, str]:
    """Who takes over the seats of a block that people play, where others would wait for who is not there."""
    persons = persons_of(block)
    if len(persons) < 2:
        return {}
    if isinstance(block.stands_in, str):
        return dict.fromkeys(persons, block.stands_in)
    return {seat: block.stands_in.get(seat, SCRIPT) for seat in persons}


def players_of(block: Block) -> dict[str, str]:
    """Who may choose the acts of seats of a block besides people: of each such seat its player, or who stands in."""
    others = {seat: who for seat, who in seats_of(block).items() if who != PERSON}
    return others | stand_ins_of(block)


def is_model(who: str) -> bool:
    """Whether a language model is meant."""
    return who.startswith(MODEL_PREFIX)


def rival_of(who: str) -> str | None:
    """NAME of `rival:NAME`; None of any other player."""
    return who.removeprefix(RIVAL_PREFIX) if who.startswith(RIVAL_PREFIX) else None


def is_rival(who: str) -> bool:
    """Whether a rival of the scenario is meant."""
    return rival_of(who) is not None


def is_trained(who: str) -> bool:
    """Whether a trained agent is meant, by its name or its path."""
    return not (who in WHO or is_model(who) or is_rival(who))


def rival_of_agent(block: Block) -> str | None:
    """The rival that plays the agent of a block, now or when a person leaves; None if none does."""
    return rival_of(players_of(block).get(AGENT, ""))


def scripts_agent(block: Block) -> bool:
    """Whether the agent of a block has to follow its script, now or when a person leaves or a model fails."""
    who = players_of(block).get(AGENT, "")
    return who == SCRIPT or is_model(who)


def asked_by(study: Study, folder: Path) -> ModelOptions:
    """How a study whose file lies in a folder asks language models.

    Raises:
        OptionError: its options do not go together, or prices lack a model.
    """
    given = {} if study.model is None else study.model.model_dump(exclude_none=True)
    if "prices" in given:
        given["prices"] = prices_from_anywhere(given["prices"], folder)
        for who in models_of(study):
            prices_of(who.removeprefix(MODEL_PREFIX), given["prices"])
    return ModelOptions(**given)


def models_of(study: Study) -> tuple[str, ...]:
    """The language models that may play in a study, each once."""
    found = (who for block in study.blocks for who in players_of(block).values() if is_model(who))
    return tuple(dict.fromkeys(found))


def check_study(resolved: ResolvedFile, bag: DiagnosticBag) -> LoadedStudy | None:
    """A study with its pages and its design; None if they cannot be understood. `bag` takes the findings."""
    shaped = model_of(Study, resolved.tree, bag, parameters=False)
    if shaped.model is None:
        return None
    study, resolved = shaped.model, resolved.mended(shaped.tree)
    check = _Check(resolved, bag)
    pictures: dict[str, Path] = {}
    consent = check.page(study.consent, ("consent",), pictures)
    instructions = [
        check.page(page, ("instructions", number), pictures) for number, page in enumerate(study.instructions)
    ]
    check.questions(study)
    check.model(study)
    for number, block in enumerate(study.blocks):
        check.who(block, ("blocks", number))
    design = design_of(study, shaped.tree, bag)
    check.participants(study, design)
    return LoadedStudy(study, resolved, design or Design((), ()), consent, tuple(instructions), pictures)


def check_seats(study: LoadedStudy, number: int, loaded: Loaded, bag: DiagnosticBag) -> bool:
    """Whether what is played in a block has the seats of it, with their scripts; `bag` says what it lacks."""
    known = len(bag)
    block, tree = study.study.blocks[number], study.resolved.tree
    names, scripted = _seats(loaded)
    for key, seats in _written(block):
        for seat in seats:
            if seat not in names:
                span = tree.key_span(("blocks", number, key, seat))
                advice = advice_on(seat, names, "its seats are " + ", ".join(names))
                bag.error("S201", f"`{loaded.name}` has no seat `{seat}`", span, **advice)
    stand_ins = stand_ins_of(block)
    for seat, who in players_of(block).items():
        place = _place_of(block, seat)
        span = tree.value_span(("blocks", number, *place))
        # What the agent follows may come from the variant `oracle`, which is looked for where it is played.
        if seat in names and seat != AGENT and who == SCRIPT and seat not in scripted:
            hint = (
                "`stands_in: random`, or `stands_in: nobody`"
                if seat in stand_ins
                else "one of " + ", ".join(WHO)
            )
            bag.error("S704", f"there is no script for `{seat}` of `{loaded.name}`", span, hint=hint)
        rival = rival_of(who)
        if seat == AGENT and rival is not None:
            _check_rival(rival, loaded, span, bag)
    return len(bag) == known


def check_sessions(study: LoadedStudy, number: int, loaded: Loaded, bag: DiagnosticBag) -> bool:
    """Whether a block keeps the sessions of its scenario together; `bag` says why not."""
    block, tree, session = study.study.blocks[number], study.resolved.tree, session_of(loaded)
    if session == 1:
        return True
    said, place = f"the {session} episodes of a session of `{loaded.name}`", ("blocks", number)
    if block.shuffle:
        message, hint = f"`shuffle` parts {said}", "leave `shuffle` out"
        bag.error("S107", message, tree.key_span((*place, "shuffle")), hint=hint)
        return False
    if block.episodes % session:
        hint = f"`episodes: {-(-block.episodes // session) * session}`"
        message = f"{block.episodes} episodes are no multiple of {said}"
        bag.error("S106", message, tree.value_span((*place, "episodes")), hint=hint)
        return False
    return True


def _written(block: Block) -> Iterator[tuple[str, Mapping[str, str]]]:
    """The keys of a block that say by seat who plays it."""
    yield "seats", block.seats or {}
    if not isinstance(block.stands_in, str):
        yield "stands_in", block.stands_in


def _place_of(block: Block, seat: str) -> DataPath:
    """Where a block says who plays a seat, or stands in there; of what it leaves unsaid, where the seat is named."""
    if seat in stand_ins_of(block):
        if not isinstance(block.stands_in, str) and seat in block.stands_in:
            return ("stands_in", seat)
        if isinstance(block.stands_in, str) and block.stands_in not in STANDING_IN:
            return ("stands_in",)
    return ("seats", seat)


def _check_rival(rival: str, loaded: Loaded, span: Span, bag: DiagnosticBag) -> None:
    """Report a rival that a scenario does not have."""
    for one in loaded.members if isinstance(loaded, LoadedSuite) else (loaded,):
        assert isinstance(one, LoadedScenario), "internal: there is nothing else that can be played"
        rivals = list(one.scenario.rivals)
        if rival not in rivals:
            advice = advice_on(rival, rivals, f"its rivals are {', '.join(rivals) or 'none'}")
            bag.error("S201", f"`{one.name}` has no rival `{rival}`", span, **advice)


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
                hint = "write such a file in the study's folder, or the text itself in its place"
                message = f"there is no file `{written}` in {display_name(self._folder)}"
                self._bag.error("S903", message, span, **advice_on(written, beside, hint))
                return ""
            try:
                text = read_source(file).text
            except ScenarioError as error:
                self._bag.error("S903", f"`{written}`: {error.diagnostics[0].message}", span)
                return ""
        for name in map("".join, _PICTURE.findall(text)):
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

    def model(self, study: Study) -> None:
        """Report options of language models that do not go together."""
        try:
            asked_by(study, self._folder)
        except OptionError as error:
            self._bag.error("S104", str(error), self._tree.value_span(("model", error.name)))
        for key in ("concurrency", "probes"):
            if study.model is not None and getattr(study.model, key) is not None:
                message = f"`{key}` changes nothing in a study: each model plays its own seat, and is asked no probes"
                self._bag.error("S107", message, self._tree.key_span(("model", key)), hint="leave it out")

    def who(self, block: Block, place: DataPath) -> None:
        """Report players that do not exist or cannot have the seat, and a block without a person."""
        for seat, who in (block.seats or {}).items():
            self._player(who, (seat,), WHO, (*place, "seats", seat))
        if isinstance(block.stands_in, str):
            seats = tuple(stand_ins_of(block))
            self._player(block.stands_in, seats, STANDING_IN, (*place, "stands_in"))
        else:
            for seat, who in block.stands_in.items():
                where = (*place, "stands_in", seat)
                self._player(who, (seat,), STANDING_IN, where)
                if seat not in stand_ins_of(block):
                    message = f"nobody stands in for `{seat}`"
                    hint = "leave it out: people who play alone are waited for, and who is no person stays"
                    self._bag.error("S107", message, self._tree.key_span(where), hint=hint)
        if not persons_of(block):
            message = "no seat of this block is a person's"
            hint = "write `person` for one of them, or leave out the agent's seat"
            self._bag.error("S904", message, self._tree.key_span((*place, "seats")), hint=hint)

    def _player(self, who: str, seats: Sequence[str], words: Sequence[str], place: DataPath) -> None:
        """Report a player that does not exist, or a rival on another seat than the agent's."""
        shipped = [PREFIX + name for name in shipped_agents()]
        span = self._tree.value_span(place)
        if is_rival(who) and any(seat != AGENT for seat in seats):
            message = f"`{who}` is a frame for the seat `{AGENT}` alone"
            hint = f"by seat, with another player on the others: `stands_in: {{{AGENT}: {who}}}`"
            hint = hint if AGENT in seats else f"one of {', '.join(words)}"
            self._bag.error("S703", message, span, hint=hint)
        named = who not in (MODEL_PREFIX, RIVAL_PREFIX) and (is_model(who) or is_rival(who))
        if named or who in (*words, *shipped) or (who not in WHO and (self._folder / who).exists()):
            return
        known = f"{', '.join(words)}, {PREFIX}NAME, {MODEL_PREFIX}MODEL, {RIVAL_PREFIX}NAME for the agent"
        hint = f"one of {known}, or the path of a checkpoint or of a run's folder"
        message = f"there is no checkpoint `{who}` in {display_name(self._folder)}"
        if who == PERSON:
            message, hint = "a person stands in for nobody", f"one of {known}"
        self._bag.error("S703", message, span, **advice_on(who, (*words, *shipped), hint))

    def participants(self, study: Study, design: Design | None) -> None:
        """Warn of groups that cannot be filled alike."""
        if design is None or study.participants is None or study.participants % len(design.orders) == 0:
            return
        groups = len(design.orders)
        lower = study.participants - study.participants % groups
        hint = f"`participants: {lower + groups}`" + (f", or {lower}" if lower else "")
        message = f"{study.participants} participants cannot be divided equally among {groups} groups"
        self._bag.warning("W905", message, self._tree.value_span(("participants",)), hint=hint)
