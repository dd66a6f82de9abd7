"""What is wrong with files: found by reading, by compiling the layouts of suites and, if wished, by playing."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from socialai_dsl import frontend
from socialai_dsl.analysis.effort import Effort
from socialai_dsl.checking.formats import CheckedInput
from socialai_dsl.diagnostics import Diagnostic, ScenarioError, is_usage
from socialai_dsl.frontend import UNUSED, CheckResult
from socialai_dsl.loader.given import STDIN, given_files, standard_input

Say = Callable[[str], None]


def validate(
    paths: Iterable[str],
    stdin_name: str = "stdin.yaml",
    effort: Callable[[], Effort] | None = None,
    say: Say | None = None,
) -> list[CheckedInput]:
    """Check files and scenarios, as `socialai validate` does; what is wrong with them is returned.

    A comment that is idle in its own file but silences a warning in another file that is checked is fine.

    Args:
        paths: files, folders, names of scenarios, or `-` for standard input.
        stdin_name: of the file that is on standard input.
        effort: makes what is spent on playing each scenario that has no errors; None: nothing is played.
        say: takes lines about what playing shows, as it goes.

    Raises:
        ScenarioError: there is no scenario of a name.
        UsageError: there is no YAML file below a folder.
        OSError: a file cannot be read.
        KeyboardInterrupt: playing was interrupted.
    """
    results = [_checked(name, stdin_name) for name in given_files(paths)]
    used = {span for _, result in results for span in result.used}
    checked = []
    for name, result in results:
        found = [d for d in result.diagnostics if d.code != UNUSED or d.span not in used]
        if not result.has_errors:
            found += _rehearsed(result, judged=effort is not None)
            found += _tried(result, effort, say) if effort is not None else ()
        checked.append(CheckedInput(name, tuple(found), result.sources))
    return checked


def _checked(name: str, stdin_name: str) -> tuple[str, CheckResult]:
    """What is checked, as it is called, and the result."""
    if name == STDIN:
        try:
            texts = standard_input(stdin_name)
        except ScenarioError as error:  # no text at all, which is a finding in it as in a file
            found = error.diagnostics
            return stdin_name, CheckResult(stdin_name, None, None, found, error.sources, None)
        result = frontend.check(Path(stdin_name).absolute(), texts, every_value=True)
        name = stdin_name
    else:
        if name.endswith((".yaml", ".yml")):
            with open(name, "rb") as file:  # raises OSError where it cannot be read: usage, not a finding
                file.read(1)
        result = frontend.check(name, every_value=True)
        if result.has_errors and is_usage(result.diagnostics):
            raise ScenarioError(result.diagnostics, result.sources)
    return name, replace(result, diagnostics=(*result.diagnostics, *_misfits(result)))


def _misfits(result: CheckResult) -> Iterator[Diagnostic]:
    """What is wrong with the layouts of a suite, which only its compiled scenarios can tell."""
    if result.suite is None or not any(result.suite.starts):
        return
    # Other files are checked without NumPy, Numba and Gymnasium.
    from socialai_dsl.compilation import compile_loaded
    from socialai_dsl.envs.starts import check_starts

    try:
        check_starts(result.suite, compile_loaded(result.suite))
    except ScenarioError as error:
        yield from error.diagnostics


def _rehearsed(result: CheckResult, judged: bool) -> Iterator[Diagnostic]:
    """What is wrong with tests when they are played: rooms that cannot be, acts after the end; if they are `judged`,
    what they expect as well.
    """
    if not result.tested:
        return  # other files are checked without NumPy, Numba and Gymnasium
    from socialai_dsl.envs.dialogues import Rehearsal

    for one in result.tested:
        rehearsal = Rehearsal(one)
        for plan in one.loaded.checked.tests:
            yield from rehearsal.play(plan, judged).findings


def _tried(result: CheckResult, effort: Callable[[], Effort], say: Say | None) -> Iterator[Diagnostic]:
    """What trying the scenario of a file out shows, or the members of a suite."""
    if result.checked is None and result.suite is None:
        return
    from socialai_dsl.analysis.check import check_scenario, compile_engine, scenarios_of

    compile_engine()  # before the time of the first scenario begins

    # What was checked, also where it came from standard input.
    texts = {source.path: source for source in result.sources.values() if source.path is not None}
    for loaded, called, script, named in scenarios_of(result.name, texts):
        report = check_scenario(loaded, called, effort(), True, say, texts, script, named)
        yield from report.findings()
        if report.interrupted:
            raise KeyboardInterrupt
