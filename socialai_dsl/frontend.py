"""From a scenario's name to a checked scenario or suite, or to everything that is wrong with it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple, NoReturn

from socialai_dsl import cures
from socialai_dsl.checking.curricula import check_curriculum
from socialai_dsl.checking.experiments import (
    LoadedExperiment,
    check_experiment,
    from_anywhere,
)
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite, unscripted
from socialai_dsl.checking.scenarios import (
    check_library,
    check_npc,
    check_scenario,
    naming_the_patch,
    of_other_values,
    with_findings_on_rivals,
    with_frames,
    with_rival,
)
from socialai_dsl.checking.studies import (
    AGENT,
    PRACTICE,
    LoadedStudy,
    check_block_names,
    check_seats,
    check_sessions,
    check_study,
    is_model,
    players_of,
    rival_of_agent,
    scripts_agent,
)
from socialai_dsl.checking.suites import check_suite
from socialai_dsl.checking.tests import KIND as TESTS_OF
from socialai_dsl.checking.tests import Tested, check_tests, tested_by
from socialai_dsl.diagnostics import (
    CODES,
    Diagnostic,
    DiagnosticBag,
    ScenarioError,
    Severity,
    advice_on,
    bounded_suggestions,
    did_you_mean,
)
from socialai_dsl.loader.comments import comments_of
from socialai_dsl.loader.reader import Library, display_name, read_document
from socialai_dsl.loader.resolved import ResolvedFile, resolve, taken_apart
from socialai_dsl.schema.annotations import held_at
from socialai_dsl.schema.curriculum import Curriculum
from socialai_dsl.schema.files import model_of_file
from socialai_dsl.schema.holds import TEXTS
from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.semantics.plans import CheckedScenario
from socialai_dsl.source import DataPath, Source, Span, Style

__all__ = [
    "CheckResult",
    "Loaded",
    "LoadedExperiment",
    "LoadedScenario",
    "LoadedStudy",
    "LoadedSuite",
    "Scripted",
    "Tested",
    "check",
    "closest_script",
    "load",
    "load_curriculum",
    "load_experiment",
    "load_study",
    "variant_of",
]

UNUSED: Final = "W008"

_IGNORE: Final = re.compile(r"#\s*socialai:\s*ignore\b(?:\s*=\s*(?P<codes>[^\s,]+(?:\s*,\s*[^\s,]+)*))?")
"""Codes are divided by commas; what follows them is a reason for people."""

_CODE: Final = re.compile(r"[^\s,]+")
_WARNINGS: Final = [code for code in CODES if code.startswith("W") and code != UNUSED]
_OF_TRIALS: Final = frozenset({"S801", "W802"})
"""What only trying a scenario out shows, so that a comment about it is never idle."""


@dataclass(frozen=True)
class Ignore:
    """One code that a comment names, and where."""

    code: str
    span: Span

    @property
    def key(self) -> tuple[str, int, str]:
        """The key of the warnings that it ignores."""
        return self.span.file, self.span.line, self.code


@dataclass(frozen=True)
class SiftedFindings:
    """Findings, divided by what comments say.

    Attributes:
        kept: what is left, with what is wrong with the comments.
        used: the places of the codes in comments that silenced a warning.
    """

    kept: tuple[Diagnostic, ...]
    used: frozenset[Span]


def sift(found: Iterable[Diagnostic], sources: Mapping[str, Source], judged: str | None) -> SiftedFindings:
    """Take out the warnings that comments ignore.

    Args:
        found: the findings of one scenario.
        sources: the files they may point into.
        judged: the file whose comments have to silence something; None if the warnings are not all known, as of a
            file with mistakes or one that others build on.
    """
    found = tuple(found)
    ignores = [ignore for source in sources.values() for ignore in ignores_in(source)]
    if not ignores:
        return SiftedFindings(found, frozenset())
    silenced = _silenced(found, ignores)
    failed = {_key(d) for d in found if d.severity is Severity.ERROR}
    bag = DiagnosticBag(d for d in found if _key(d) not in silenced or d.severity is Severity.ERROR)
    for ignore in ignores:
        if ignore.code not in CODES or ignore.code == UNUSED:
            bag.add(_no_warning(ignore))
        elif ignore.key in failed:
            message = f"`{ignore.code}` is an error here, and only warnings can be ignored"
            bag.warning(UNUSED, message, ignore.span)
        elif ignore.span.file == judged and ignore.key not in silenced and ignore.code not in _OF_TRIALS:
            message = f"this line has no warning `{ignore.code}`"
            bag.warning(UNUSED, message, ignore.span, hint=_without(ignore, sources[ignore.span.file]))
    return SiftedFindings(tuple(bag), frozenset(i.span for i in ignores if i.key in silenced))


def _without(ignore: Ignore, source: Source) -> cures.Hint:
    """The proposal to delete a code from a comment, or all of the comment where it names no other."""
    start = source.index(ignore.span)
    end = start + len(ignore.code)
    line_start = source.index(source.span(ignore.span.line, 1))
    comment = next(found for found in _IGNORE.finditer(source.text, line_start) if found.end() >= end)
    codes = _CODE.findall(comment["codes"] or "")
    if len(codes) > 1:
        last = codes[-1] == ignore.code
        behind = re.compile(r"\s*,\s*").match(source.text, end)
        before = re.compile(r"\s*,\s*$").search(source.text, line_start, start)
        edges = (
            (before.start() if before else start, end) if last or behind is None else (start, behind.end())
        )
        return cures.propose(f"delete `{ignore.code}`", source.edit(*edges, ""))
    line_end = line_start + len(source.line(ignore.span.line))
    start = line_start + len(source.text[line_start : comment.start()].rstrip())
    if start == line_start:
        line_end = min(line_end + 1, len(source.text))
    return cures.propose("delete the comment", source.edit(start, line_end, ""))


def not_ignored(found: Iterable[Diagnostic], sources: Mapping[str, Source]) -> Iterator[Diagnostic]:
    """The findings without the warnings that comments ignore."""
    found = tuple(found)
    silenced = _silenced(found, [ignore for source in sources.values() for ignore in ignores_in(source)])
    return (d for d in found if _key(d) not in silenced or d.severity is Severity.ERROR)


def _silenced(found: Sequence[Diagnostic], ignores: Iterable[Ignore]) -> frozenset[tuple[str, int, str]]:
    """The keys of the warnings that comments ignore: whatever their code, but for the one about such comments."""
    warned = {_key(d) for d in found if d.severity is Severity.WARNING and d.code != UNUSED}
    return frozenset(ignore.key for ignore in ignores if ignore.key in warned)


def ignores_in(source: Source) -> Iterator[Ignore]:
    """The codes that a file's comments ignore; none if the file is no YAML."""
    if _IGNORE.search(source.text) is None:
        return
    try:
        document = read_document(source)
    except ScenarioError:
        return
    for comment in comments_of(document):
        match = _IGNORE.match(comment.text)
        if match is None:
            continue
        if match["codes"] is None:
            yield Ignore("", comment.span)
            continue
        for code in _CODE.finditer(comment.text, match.start("codes"), match.end("codes")):
            yield Ignore(code.group(), comment.span.shifted(code.start(), len(code.group())))


def _key(finding: Diagnostic) -> tuple[str, int, str]:
    return finding.span.file, finding.span.line, finding.code


def _no_warning(ignore: Ignore) -> Diagnostic:
    """The finding for a code that cannot be ignored."""
    hint = "a comment ignores the warnings it names: `# socialai: ignore=" + ", ".join(_WARNINGS[:2]) + "`"
    near = None
    if not ignore.code:
        message = "this comment names no warning to ignore"
    elif ignore.code == UNUSED:
        message = f"`{UNUSED}` cannot be ignored: delete the comment it points at"
    else:
        near = did_you_mean(ignore.code, _WARNINGS)
        message = f"there is no warning `{ignore.code}`"
    return Diagnostic(UNUSED, message, ignore.span, Severity.WARNING, hint if near is None else None, near)


_OF_ONE_NAME: Final = frozenset({"S201", "S206", "S301", "S401"})
"""What is wrong with a name or an utterance, wherever it is used."""


_WORD: Final = re.compile(r"`[^`]+`")


def said_once(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """The findings, with what is unknown in many places shown at the first: mostly its declaration has the slip."""
    everything = list(found)
    alike: dict[tuple[str, ...], list[Diagnostic]] = {}
    for d in everything:
        alike.setdefault(_cause(d), []).append(d)
    for d in everything:
        first, *others = alike[_cause(d)]
        if d.code not in _OF_ONE_NAME or not others:
            yield d
        elif d is first:
            yield _everywhere(d, others)


def _cause(found: Diagnostic) -> tuple[str, ...]:
    """What findings of one mistake have in common: an unknown name is one, whatever it was to stand for."""
    word = _WORD.search(found.message)
    if found.code == "S201" and found.suggestion is not None and word is not None:
        return found.code, word[0], found.suggestion
    return found.code, found.text


def _everywhere(first: Diagnostic, others: Sequence[Diagnostic]) -> Diagnostic:
    """A finding that says where else it is, and is cured there, too."""
    hint = cures.noted(first.hint, _repeated(first, others))
    if not first.edits:
        return replace(first, hint=hint)
    edits = tuple(dict.fromkeys(edit for one in (first, *others) for edit in one.edits))
    whole = hint if isinstance(hint, cures.Cure) else cures.Cure("", (), str(hint))
    return replace(first, hint=replace(whole, edits=edits))


def _repeated(first: Diagnostic, others: Sequence[Diagnostic]) -> str:
    """Where else it is: lines of the same file, and other files."""
    lines = sorted({d.span.line for d in others if d.span.file == first.span.file} - {first.span.line})
    files = sorted({d.span.file for d in others} - {first.span.file})
    where = ([f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines))}"] if lines else []) + files
    return f"the same is in {' and in '.join(where)}" if where else "the same is in this line once more"


_GLUED: Final = re.compile(r"[ \t]+(#\w\S*)")
"""A comment whose text begins without a blank, as in `#1`."""


def swallowed(resolved: ResolvedFile) -> Iterator[Diagnostic]:
    """A warning for each text that is written without quotes and seems to go on behind a `#`."""
    model = model_of_file(resolved.data) if isinstance(resolved.data, dict) else None
    for path, node in resolved.tree.walk():
        span, text = node.span, node.value
        if not isinstance(text, str) or span.style is not Style.PLAIN:
            continue
        comment = _GLUED.match(node.source.text, span.end)
        held = held_at(model, path) if comment is not None and model is not None else None
        if comment is None or held is None or held.kind not in TEXTS - {"state"}:
            continue
        place = span.value.shifted(comment.start(1) - span.start, len(comment[1]))
        message = f"`{comment[1]}` is a comment, so the text is only `{text}`"
        whole = cures.in_quotes(node.source.text[span.start : comment.end(1)])
        edit = node.source.edit(span.start, comment.end(1), whole)
        hint = cures.write(whole, edit, "if it is a comment, write a blank after the `#`")
        yield Diagnostic("W009", message, place, Severity.WARNING, hint)


@dataclass(frozen=True)
class CheckResult:
    """The result of checking one file or name.

    Attributes:
        name: as it was asked for.
        checked: the scenario with everything resolved; None if there are errors, or if it is not a scenario.
        scenario: its models; None if its shape is wrong, or if it is not a scenario.
        diagnostics: sorted by place. sources: name -> source of every file read.
        resolved: the data with its positions; None if the files could not be read.
        suite: the suite with its members, if it is one and nothing is wrong with it.
        used: the places of the codes in comments that silenced a warning.
        experiment: the experiment with its conditions, if it is one and nothing is wrong with it.
        curriculum: the curriculum, if it is one and nothing is wrong with it.
        study: the study, if it is one and nothing is wrong with it.
        tested: the scenarios that its tests play, with them; it may be a scenario or a file of tests.
    """

    name: str
    checked: CheckedScenario | None
    scenario: Scenario | None
    diagnostics: tuple[Diagnostic, ...]
    sources: dict[str, Source]
    resolved: ResolvedFile | None
    suite: LoadedSuite | None = None
    used: frozenset[Span] = frozenset()
    experiment: LoadedExperiment | None = None
    curriculum: Curriculum | None = None
    study: LoadedStudy | None = None
    tested: tuple[Tested, ...] = ()

    @property
    def whole(self) -> ResolvedFile | None:
        """What the expressions in it are about: of a file of tests the scenario, else `resolved`."""
        if self.resolved is None or self.resolved.kind != TESTS_OF:
            return self.resolved
        return tested_by(self.resolved)

    @property
    def has_errors(self) -> bool:
        """Whether it cannot be used."""
        return any(d.severity is Severity.ERROR for d in self.diagnostics)

    def read(self) -> ResolvedFile:
        """The data, if nothing is wrong.

        Raises:
            ScenarioError: with all findings, if one of them is an error.
        """
        if self.has_errors:
            raise ScenarioError(self.diagnostics, self.sources)
        assert self.resolved is not None, "internal: nothing was read, and nothing is wrong"
        return self.resolved


def load(name: str | Path, texts: Mapping[Path, Source] | None = None) -> Loaded:
    """Read and check a scenario or suite.

    Args:
        name: a shipped name or the path of a file, with variants and parameters: `talkitout+unsocial`, `a.yaml?n=2`.
        texts: contents that stand for those of files, such as an editor's unsaved text.

    Raises:
        ScenarioError: with all findings, if one of them is an error.
    """
    result = check(name, texts, tests=False)
    loaded = None if result.has_errors else _loaded(result)
    return loaded or _refuse(result, "only a scenario or a suite can be run")


def _loaded(result: CheckResult) -> Loaded | None:
    """What was checked and has no errors, if it can be run."""
    if result.suite is not None:
        return result.suite
    if result.checked is None or result.scenario is None or result.resolved is None:
        return None
    return LoadedScenario(
        result.checked.name, result.checked, result.scenario, result.resolved, result.diagnostics
    )  # fmt: skip


class Scripted(NamedTuple):
    """A scenario or suite, as a rule with a script for the agent; `loaded` is what `load(name)` returns."""

    name: str
    loaded: Loaded


def closest_script(
    name: str, loaded: Loaded | None = None, texts: Mapping[Path, Source] | None = None
) -> Scripted:
    """The scenario itself if its agent follows a frame, else its variant `oracle`, if it has one.

    Some members of a suite may lack a script even there; `unscripted` names them.

    Args:
        name: a path or the name of a shipped scenario, with variants and parameters.
        loaded: the same, where it is loaded already.
        texts: those that it is loaded with, see `check`.

    Raises:
        ScenarioError: the scenario, or its variant, has mistakes.
    """
    plain = Scripted(name, loaded or load(name, texts))
    if not unscripted(plain.loaded):
        return plain
    oracle = variant_of(name, "oracle")
    try:
        return Scripted(oracle, load(oracle, texts))
    except ScenarioError as error:
        if _is_not_there(error):
            return plain
        raise


def following(loaded: LoadedScenario, frames: Mapping[str, str]) -> LoadedScenario:
    """A scenario in which members of the cast follow other frames of it, by member.

    Raises:
        ScenarioError: one of them cannot follow its frame.
    """
    resolved, bag = with_frames(loaded.resolved, frames), DiagnosticBag()
    checked, scenario = check_scenario(resolved, bag)
    bag.raise_errors(resolved.files)
    assert checked is not None, "internal: it has no mistakes"
    assert scenario is not None, "internal: it has no mistakes"
    return LoadedScenario(loaded.name, checked, scenario, resolved)


def rival_of(loaded: LoadedScenario, rival: str) -> LoadedScenario:
    """A scenario whose agent follows one of its rivals.

    Raises:
        ValueError: it has no rival of this name.
    """
    if rival not in loaded.scenario.rivals:
        raise ValueError(f"rival: got {rival!r}, expected one of {', '.join(loaded.scenario.rivals)}")
    resolved, bag = with_rival(loaded.resolved, rival), DiagnosticBag()
    checked, scenario = check_scenario(resolved, bag)
    bag.raise_errors(resolved.files)
    assert checked is not None, "internal: rivals have been checked"
    assert scenario is not None, "internal: rivals have been checked"
    return LoadedScenario(f"{loaded.name}+{rival}", checked, scenario, resolved)


def variant_of(name: str, variant: str) -> str:
    """How the variant of a scenario is called, whose parameters stay."""
    base, mark, parameters = name.partition("?")
    return f"{base}+{variant}{mark}{parameters}"


def _is_not_there(error: ScenarioError) -> bool:
    """Whether nothing is wrong but that a name does not exist; a member of a suite may have no name of its own."""
    return all(diagnostic.code in ("S503", "S504", "S508") for diagnostic in error.diagnostics)


def _check_claimed_script(
    name: str, checked: CheckedScenario, texts: Mapping[Path, Source] | None, bag: DiagnosticBag
) -> None:
    """Report claims about a script that is not there."""
    claims = [plan for plan in checked.properties if plan.kind in ("oracle", "script")]
    if not claims or any(frame.entity == 0 for frame in checked.frames):
        return
    try:
        resolve(variant_of(name, "oracle"), texts=texts)
    except ScenarioError as error:
        for plan in claims if _is_not_there(error) else ():
            hint = "give it a variant `oracle` in which the agent follows a frame"
            message = f"`{plan.kind}` is about the agent's script, and `{checked.name}` has none"
            bag.warning("S704", message, plan.span, hint=hint)


def load_experiment(name: str | Path) -> LoadedExperiment:
    """An experiment's file, with its conditions.

    Raises:
        ScenarioError: with all findings, if one of them is an error, or S108 if it is a file of another kind.
    """
    result = check(name)
    return result.experiment or _refuse(result, "expected an experiment", _AN_EXPERIMENT)


def load_curriculum(path: str | Path) -> Curriculum:
    """A curriculum's file.

    Raises:
        ScenarioError: with all findings, if one of them is an error, or S108 if it is a file of another kind.
    """
    result = check(path)
    return result.curriculum or _refuse(result, "expected a curriculum")


def load_study(path: str | Path) -> LoadedStudy:
    """A study's file, with its scenarios.

    Raises:
        ScenarioError: with all findings, if one of them is an error, or S108 if it is a file of another kind.
    """
    result = check(path)
    return result.study or _refuse(result, "expected a study", _A_STUDY)


_AN_EXPERIMENT: Final = (
    "it is a file of its own: `experiment: NAME`, `conditions: [{scenario: SCENARIO, frames: N}]`"
)
_A_STUDY: Final = (
    "it is a file of its own: `study: NAME`, `consent: TEXT`, `blocks: [{scenario: SCENARIO, episodes: N}]`"
)


def _refuse(result: CheckResult, expected: str, hint: str | None = None) -> NoReturn:
    """Raise what is wrong with a file, or that it is of another kind than expected."""
    resolved = result.read()
    message = f"this is {_kind_of(result)}; {expected}"
    span = resolved.tree.key_span((resolved.kind,))
    raise ScenarioError([Diagnostic("S108", message, span, hint=hint)], result.sources)


def _kind_of(result: CheckResult) -> str:
    """What a file that is not what was expected is, in words."""
    kind = result.read().kind
    if kind == "scenario" and result.checked is None:
        return "an abstract scenario, which others build on"
    return f"a file of the kind `{kind}`"


def check(
    name: str | Path,
    texts: Mapping[Path, Source] | None = None,
    every_value: bool = False,
    tests: bool = True,
    base: Path | None = None,
) -> CheckResult:
    """Check a file, or a scenario of a name; findings are returned, never raised.

    Args:
        name: a path or the name of a shipped scenario, with variants and parameters.
        texts: resolved path -> text, for files that are not on the disk as they are meant: those of an editor.
        every_value: whether a scenario that is right is also checked with the other values of its parameters.
        tests: whether the tests in a scenario's file are checked, too.
        base: the folder of the file that names it; by default the working directory.
    """
    with bounded_suggestions():
        return _check(str(name), texts, every_value, tests, base)


def _check(
    name: str,
    texts: Mapping[Path, Source] | None,
    every_value: bool,
    tests: bool,
    base: Path | None,
) -> CheckResult:
    try:
        resolved = resolve(name, folder=base, texts=texts)
    except ScenarioError as error:
        return CheckResult(name, None, None, tuple(DiagnosticBag(error.diagnostics)), error.sources, None)
    bag = DiagnosticBag()
    bag.extend(swallowed(resolved))
    if resolved.kind == "suite":
        suite = check_suite(resolved, bag)
        return _sifted(
            CheckResult(name, None, None, tuple(said_once(bag)), dict(resolved.files), resolved, suite)
        )
    if resolved.kind == "curriculum":
        phases = check_curriculum(resolved, bag)
        files, found = dict(resolved.files), tuple(bag)
        curriculum = None if bag.has_errors else phases
        return _sifted(CheckResult(name, None, None, found, files, resolved, curriculum=curriculum))
    if resolved.kind == "experiment":
        experiment = check_experiment(resolved, bag)
        files = dict(resolved.files)
        right = None
        if experiment is not None:
            played = _check_played(experiment, bag, files)
            _check_curricula(experiment, bag, files)
            _check_scripts(experiment, played, bag, files)
            _check_rivals(experiment, played, bag)
            right = None if bag.has_errors else replace(experiment, played=played)
        found = tuple(bag)
        return _sifted(CheckResult(name, None, None, found, files, resolved, experiment=right))
    if resolved.kind == "study":
        study, files = check_study(resolved, bag), dict(resolved.files)
        if study is not None:
            in_study = _check_study_played(study, bag, files)
            study = replace(study, played=in_study)
            check_block_names(study, bag)
            study = None if bag.has_errors else study
        return _sifted(CheckResult(name, None, None, tuple(bag), files, resolved, study=study))
    if resolved.kind == TESTS_OF:
        tested = check_tests(resolved, bag)
        found = tuple(said_once(bag))
        return _sifted(CheckResult(name, None, None, found, dict(resolved.files), resolved, tested=tested))
    checked, scenario = _checked(resolved, bag)
    if checked is not None and resolved.path.is_file():  # else there is no telling what stands beside it
        _check_claimed_script(name, checked, texts, bag)
    if scenario is not None and checked is not None and scenario.rivals:
        bag = with_findings_on_rivals(bag, resolved, scenario)
        checked = None if bag.has_errors else checked
    if every_value and checked is not None:
        bag.extend(of_other_values(resolved))
    # A variant's tests are those that say so (`of`); what a scenario is without it need not be true of it.
    tested = ()
    if (
        tests
        and resolved.kind == "scenario"
        and resolved.tree.entry("tests") is not None
        and not resolved.edits
    ):
        tested = check_tests(resolved, bag)
    found = tuple(DiagnosticBag(naming_the_patch(d, resolved) for d in said_once(bag)))
    result = CheckResult(name, checked, scenario, found, dict(resolved.files), resolved, tested=tested)
    return _sifted(result)


def _sifted(result: CheckResult) -> CheckResult:
    """Without the warnings that comments ignore; a file whose warnings are all known is to have no idle ones."""
    assert result.resolved is not None, "internal: what was checked has been read"
    wholes = (result.checked, result.suite, result.experiment, result.curriculum, result.study)
    meant = result.tested or any(part is not None for part in wholes)
    judged = display_name(result.resolved.path) if meant and not result.has_errors else None
    sifted = sift(result.diagnostics, result.sources, judged)
    suite = result.suite
    if suite is not None and sifted.used:
        suite = replace(suite, warnings=sifted.kept)
    return replace(result, diagnostics=sifted.kept, used=sifted.used, suite=suite)


def _checked(resolved: ResolvedFile, bag: DiagnosticBag) -> tuple[CheckedScenario | None, Scenario | None]:
    """A file that is no suite; only a scenario has a meaning of its own."""
    match resolved.kind:
        case "scenario":
            return check_scenario(resolved, bag)
        case "npc":
            check_npc(resolved, bag)
        case "library":
            check_library(resolved, bag)
    return None, None  # the shape of a variant of any scenario was checked when it was read


def _check_played(
    experiment: LoadedExperiment, bag: DiagnosticBag, files: dict[str, Source]
) -> dict[str, Loaded]:
    """Check the scenarios that an experiment names, each once, and return those that are right.

    What is wrong with a name points into the experiment; what is wrong with a file, into that.
    """
    played: dict[str, Loaded] = {}
    for name, written, place in experiment.named():
        span = experiment.resolved.tree.value_span(place)
        if _is_outside(name, experiment.folder, span, bag):
            continue
        result = check(name, base=experiment.folder)
        if not result.has_errors:
            loaded = _loaded(result)
            if loaded is not None:
                played[written] = loaded
                continue
            what = _kind_of(result)
            bag.error("S108", f"this is {what}; only a scenario or a suite can be run", span)
            continue
        _add_findings(result, place, experiment.resolved, bag, files)
    return played


def _is_outside(name: str, folder: Path, span: Span, bag: DiagnosticBag) -> bool:
    """Report a file that does not ship and lies outside the folder of the file that names it; links are followed."""
    base = Path(taken_apart(name)[0])
    if not base.is_absolute():
        return False  # the name of something that ships
    try:
        Library([folder]).resolved(base, span)
    except ScenarioError as error:
        bag.extend(error.diagnostics)
        return True
    return False


def _check_study_played(
    study: LoadedStudy, bag: DiagnosticBag, files: dict[str, Source]
) -> dict[int, Loaded]:
    """Check the scenarios of a study, and return those that are right by the number of their block."""
    played: dict[int, Loaded] = {}
    results: dict[str, CheckResult] = {}
    for number, name, place in study.named():
        span = study.resolved.tree.value_span(place)
        if _is_outside(name, study.folder, span, bag):
            continue
        known = name in results
        result = results[name] = results.get(name) or check(name, base=study.folder)
        loaded = None if result.has_errors else _loaded(result)
        if result.has_errors:
            if not known:
                _add_findings(result, place, study.resolved, bag, files)
            continue
        if loaded is None:
            message = f"this is {_kind_of(result)}; only a scenario or a suite can be played"
            bag.error("S108", message, span)
            continue
        played[number] = loaded
        if number == PRACTICE or not (
            check_seats(study, number, loaded, bag) and check_sessions(study, number, loaded, bag)
        ):
            continue
        block = study.study.blocks[number]
        rival = rival_of_agent(block)
        if rival is None and not scripts_agent(block):
            continue
        try:
            framed = closest_script(name, loaded).loaded if rival is None else load(variant_of(name, rival))
        except ScenarioError as error:
            _add_findings(error, place, study.resolved, bag, files)
            continue
        lacking = unscripted(framed)
        if lacking and is_model(players_of(block)[AGENT]):
            continue  # where it fails nobody takes over
        played[number] = framed
        if lacking:
            hint = "give it a variant `oracle` in which the agent follows a frame, or the block `stands_in: random`"
            bag.error("S704", f"there is no script for the agent of `{lacking[0]}`", span, hint=hint)
    return played


def _check_curricula(experiment: LoadedExperiment, bag: DiagnosticBag, files: dict[str, Source]) -> None:
    """Check the files of phases that an experiment names."""
    for path, place in experiment.curricula():
        span = experiment.resolved.tree.value_span(place)
        if _is_outside(path, experiment.folder, span, bag):
            continue
        result = check(path)
        if result.has_errors:
            _add_findings(result, place, experiment.resolved, bag, files)
        elif result.curriculum is None:
            bag.error("S108", f"this is {_kind_of(result)}; expected a curriculum", span)


def _check_scripts(
    experiment: LoadedExperiment, played: Mapping[str, Loaded], bag: DiagnosticBag, files: dict[str, Source]
) -> None:
    """Check that the scenarios whose scripts are to play or to guide have one."""
    for written, places in experiment.scripted().items():
        if written not in played:
            continue
        spans = [experiment.resolved.tree.value_span(place) for place in places]
        try:
            closest = closest_script(from_anywhere(written, experiment.folder), played[written])
        except ScenarioError as error:
            _add_findings(error, places[0], experiment.resolved, bag, files)
            continue
        lacking = unscripted(closest.loaded)
        for span in spans if lacking else ():
            hint = "give it a variant `oracle` in which the agent follows a frame"
            bag.error("S704", f"there is no script for the agent of `{lacking[0]}`", span, hint=hint)


def _check_rivals(experiment: LoadedExperiment, played: Mapping[str, Loaded], bag: DiagnosticBag) -> None:
    """Check that the scenarios whose rivals are to play have them."""
    for written, rival, place in experiment.rivals():
        if written not in played:
            continue
        loaded = played[written]
        for one in loaded.members if isinstance(loaded, LoadedSuite) else (loaded,):
            if rival not in one.scenario.rivals:
                hint = f"its rivals are {', '.join(one.scenario.rivals) or 'none'}"
                advice = advice_on(rival, list(one.scenario.rivals), hint)
                span = experiment.resolved.tree.value_span(place)
                bag.error("S201", f"`{one.name}` has no rival `{rival}`", span, **advice)


def _add_findings(
    result: CheckResult | ScenarioError,
    place: DataPath,
    naming: ResolvedFile,
    bag: DiagnosticBag,
    files: dict[str, Source],
) -> None:
    """The errors of something that a file names at a place: at their own, or in the name if that is wrong."""
    files.update({source: text for source, text in result.sources.items() if source not in files})
    for finding in result.diagnostics:
        if finding.severity is not Severity.ERROR:
            continue  # said where the file itself is checked
        if finding.span.file in result.sources and Path(finding.span.file).is_file():
            bag.add(finding)
            continue
        meant = finding.suggestion
        if meant is not None and os.path.isabs(meant):
            meant = os.path.relpath(meant, naming.path.parent)
        # A path that is written from the file's folder may be longer or shorter than that from here.
        name = naming.tree.at(place)
        asked = result.sources.get(finding.span.file)
        longer = len(finding.span.file if asked is None else asked.text) - len(str(name.value))
        offset, width = max(0, finding.span.column - 1 - longer), finding.span.width
        if finding.span.column == 1:
            offset, width = 0, width - longer
        bag.add(replace(finding, span=name.locate((), offset, width), suggestion=meant))
