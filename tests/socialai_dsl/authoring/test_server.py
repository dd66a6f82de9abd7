"""A session with the language server, as an editor has it: a process, spoken to over its standard streams."""

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types as lsp
from pygls.lsp.client import LanguageClient

from tests.socialai_dsl.authoring.marked import marked

ROOT = Path(__file__).parents[3]

BASE = """\
scenario: base
abstract: true
horizon: 20
grammar: {templates: [Open <noun>], nouns: [sesame, it]}
room: {size: 6}
objects:
  gate: {type: door, place: wall(top)}
cast:
  agent: {}
outcome: [{success: agent.at(gate)}]
"""

SCENARIO = """\
scenario: heir
extends: base.yaml
about: Ein Tor öffnet sich 🚪.
params: {patience: 4}
frames:
  duty:
    slots: {what: object}
    let: {asked: 0}
    start: watching
    states:
      watching:
        do: face(agent)
        then:
          - {hears: Open it, say: 🚪, when: eye_contact(agent), set: {asked: asked + 1}, goto: content}
      content: {}
cast:
  keeper: {frame: duty, with: {what: gate}}
outcome:
  - failure: keeper.is(content) and t > $patience
"""


class Editor:
    """An editor that has the scenario open."""

    def __init__(self, client: LanguageClient, folder: Path, found: "asyncio.Queue[Any]") -> None:
        self.client, self.folder, self.found = client, folder, found
        self.uri = (folder / "heir.yaml").as_uri()
        self.version = 0

    async def open(self, text: str) -> list[lsp.Diagnostic]:
        item = lsp.TextDocumentItem(self.uri, lsp.LanguageKind.Yaml, 0, text)
        self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(item))
        return await self.findings()

    async def change(self, text: str) -> list[lsp.Diagnostic]:
        self.version += 1
        self.client.text_document_did_change(
            lsp.DidChangeTextDocumentParams(
                lsp.VersionedTextDocumentIdentifier(self.version, self.uri),
                [lsp.TextDocumentContentChangeWholeDocument(text)],
            )
        )
        return await self.findings()

    async def findings(self) -> list[lsp.Diagnostic]:
        published = await asyncio.wait_for(self.found.get(), 30)
        assert published.uri == self.uri
        return list(published.diagnostics)

    def at(self, text: str) -> tuple[str, lsp.Position]:
        """The text without its mark `^`, and the position of the mark as editors count: in UTF-16."""
        plain, line, column = marked(text)
        before = plain.split("\n")[line - 1][: column - 1]
        return plain, lsp.Position(line - 1, len(before.encode("utf-16-le")) // 2)

    async def cured(self, text: str) -> tuple[str, str] | None:
        """The title of the cure of the only finding in a text, and the text with it."""
        found = await self.change(text)
        if not found:
            return None
        here = lsp.CodeActionParams(
            lsp.TextDocumentIdentifier(self.uri), found[0].range, lsp.CodeActionContext(found)
        )
        answer = await self.client.text_document_code_action_async(here)
        assert answer is not None
        (action,) = answer
        assert isinstance(action, lsp.CodeAction)
        assert action.edit is not None
        assert action.edit.changes is not None
        ((uri, (edit,)),) = action.edit.changes.items()
        assert uri == self.uri
        start, end = (index_of(text, place) for place in (edit.range.start, edit.range.end))
        return action.title, text[:start] + edit.new_text + text[end:]

    async def complete(self, text: str) -> list[str]:
        plain, position = self.at(text)
        await self.change(plain)
        params = lsp.CompletionParams(lsp.TextDocumentIdentifier(self.uri), position)
        found = await self.client.text_document_completion_async(params)
        assert isinstance(found, list)
        return [item.label for item in found]

    async def hover(self, text: str) -> str:
        plain, position = self.at(text)
        await self.change(plain)
        params = lsp.HoverParams(lsp.TextDocumentIdentifier(self.uri), position)
        found = await self.client.text_document_hover_async(params)
        assert found is not None
        assert isinstance(found.contents, lsp.MarkupContent)
        return found.contents.value

    async def definition(self, text: str) -> tuple[str, int, int]:
        plain, position = self.at(text)
        await self.change(plain)
        params = lsp.DefinitionParams(lsp.TextDocumentIdentifier(self.uri), position)
        found = await self.client.text_document_definition_async(params)
        assert isinstance(found, lsp.Location), found
        start = found.range.start
        return found.uri.rpartition("/")[2], start.line + 1, start.character + 1


def index_of(text: str, place: lsp.Position) -> int:
    """Where a position stands in a text; characters are counted in UTF-16."""
    lines = text.split("\n")
    before = lines[place.line].encode("utf-16-le")[: 2 * place.character].decode("utf-16-le")
    return sum(len(line) + 1 for line in lines[: place.line]) + len(before)


def session(folder: Path, script: Callable[[Editor], Awaitable[None]]) -> lsp.InitializeResult:
    """Start the server, let an editor do something, say goodbye; it must end by itself, without complaint."""
    (folder / "base.yaml").write_text(BASE, encoding="utf-8")

    async def run() -> lsp.InitializeResult:
        client = LanguageClient("test", "1")
        found: asyncio.Queue[Any] = asyncio.Queue()

        @client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def publish(params: lsp.PublishDiagnosticsParams) -> None:
            found.put_nowait(params)

        call = "import sys; from socialai_dsl.cli.main import main; sys.exit(main(['lsp', '--stdio']))"
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        }
        await client.start_io(sys.executable, "-c", call, cwd=str(folder), env=environment)
        answer = await client.initialize_async(
            lsp.InitializeParams(capabilities=lsp.ClientCapabilities(), root_uri=folder.as_uri())
        )
        client.initialized(lsp.InitializedParams())
        try:
            await script(Editor(client, folder, found))
        finally:
            await client.shutdown_async(None)
            client.exit(None)
            await client.stop()
        return answer

    return asyncio.run(asyncio.wait_for(run(), 120))


def test_a_session(tmp_path: Path) -> None:
    async def script(editor: Editor) -> None:
        await findings(editor)
        await places(editor)
        await completions(editor)
        await hovers(editor)
        await definitions(editor)
        await formats(editor)
        await cures(editor)

    answer = session(tmp_path, script)
    offered = answer.capabilities
    assert offered.hover_provider
    assert offered.definition_provider
    assert offered.completion_provider
    assert offered.code_action_provider
    assert not (tmp_path / "heir.yaml").exists(), "nothing is written: the editor has the file"


async def cures(editor: Editor) -> None:
    """One behind a letter that takes two units, and one of several lines."""
    text = SCENARIO.replace("eye_contact(agent)", "eye_contact(agnet)")
    assert await editor.cured(text) == ("Write `agent`", SCENARIO)
    alone = BASE.replace("abstract: true\n", "")
    unused = alone.replace("cast:\n", "frames:\n  duty:\n    steps:\n      - {say: 🚪}\ncast:\n")
    assert await editor.cured(unused) == ("Delete it", alone)
    assert await editor.cured(alone) is None


async def findings(editor: Editor) -> None:
    assert await editor.open(SCENARIO) == []
    (wrong,) = await editor.change(SCENARIO.replace("eye_contact(agent)", "eye_contact(agnet)"))
    assert (wrong.code, wrong.severity, wrong.source) == ("S201", lsp.DiagnosticSeverity.Error, "socialai")
    line = SCENARIO.splitlines()[13]
    start = len(line.partition("agent)")[0].encode("utf-16-le")) // 2
    assert (wrong.range.start.line, wrong.range.start.character) == (13, start)
    assert wrong.range.end.character == start + len("agnet")
    assert "did you mean `agent`" in wrong.message
    (unfinished,) = await editor.change(SCENARIO.replace("slots: {what: object}", "slots: {what: "))
    assert unfinished.code == "S001"
    (elsewhere,) = await editor.change(SCENARIO.replace("base.yaml", "bsae.yaml"))
    assert elsewhere.code == "S504"
    (editor.folder / "base.yaml").write_text(BASE.replace("horizon", "horizn"), encoding="utf-8")
    (elsewhere,) = await editor.change(SCENARIO)
    assert elsewhere.range.start == lsp.Position(0, 0)
    assert elsewhere.message.startswith("base.yaml:3:1: unknown key `horizn`")
    (editor.folder / "base.yaml").write_text(BASE, encoding="utf-8")
    assert await editor.change(SCENARIO) == []


async def places(editor: Editor) -> None:
    """Every finding lies in the text, also in one that is empty or ends in the middle of a line."""
    for text in (
        "",
        "\n",
        "#",
        "x",
        "x:",
        "scenario: [",
        "scenario: x\nroom: {size: 🚪",
        "scenario: x\n- y",
        "a: 'b",
        "a: |",
    ):
        found = await editor.change(text)
        assert found, text
        widths = [len(line.encode("utf-16-le")) // 2 for line in text.split("\n")]
        for one in found:
            for place in (one.range.start, one.range.end):
                assert place.line < len(widths), (text, one)
                assert place.character <= widths[place.line], (text, one)


async def completions(editor: Editor) -> None:
    assert {"horizon"} <= set(await editor.complete(SCENARIO.replace("params:", "ho^\nparams:")))
    assert "scenario" not in await editor.complete(SCENARIO.replace("params:", "^\nparams:"))
    states = await editor.complete(SCENARIO.replace("goto: content}", "goto: ^}"))
    assert states == ["watching", "content"]
    verbs = await editor.complete(SCENARIO.replace("keeper.is(content)", "keeper.ey^"))
    assert verbs == ["eye_contact"]
    names = await editor.complete(SCENARIO.replace("eye_contact(agent)", "eye_contact(^)"))
    assert {"keeper", "agent", "gate", "what", "asked"} <= set(names), (
        "also those of the base and of the frame"
    )
    assert await editor.complete(SCENARIO.replace("with: {what: gate}", "with: {w^")) == ["what"]
    assert await editor.complete(SCENARIO.replace("t > $patience", "t > $^")) == ["patience"]
    assert await editor.complete(SCENARIO.replace("hears: Open it", "hears: O^")) == [
        "Open sesame",
        "Open it",
    ]


async def hovers(editor: Editor) -> None:
    assert "the state to enter" in await editor.hover(SCENARIO.replace("goto:", "go^to:"))
    assert "each facing the other" in await editor.hover(SCENARIO.replace("eye_contact(", "eye_con^tact("))
    assert "an object" in await editor.hover(SCENARIO.replace("what: gate}", "what: ga^te}"))
    assert "a state of `duty`" in await editor.hover(
        SCENARIO.replace("keeper.is(content)", "keeper.is(con^tent)")
    )
    assert "a parameter" in await editor.hover(SCENARIO.replace("$patience", "$pati^ence"))


async def definitions(editor: Editor) -> None:
    assert await editor.definition(SCENARIO.replace("what: gate}", "what: ga^te}")) == ("base.yaml", 7, 3)
    assert await editor.definition(SCENARIO.replace("frame: duty", "frame: du^ty")) == ("heir.yaml", 6, 3)
    assert await editor.definition(SCENARIO.replace("goto: content", "goto: con^tent")) == (
        "heir.yaml",
        15,
        7,
    )
    assert await editor.definition(SCENARIO.replace("is(content)", "is(con^tent)")) == ("heir.yaml", 15, 7)
    assert await editor.definition(SCENARIO.replace("with: {what", "with: {wh^at")) == ("heir.yaml", 7, 13)
    assert await editor.definition(SCENARIO.replace("$patience", "$pati^ence")) == ("heir.yaml", 4, 10)
    assert await editor.definition(SCENARIO.replace("extends: base", "extends: ba^se")) == ("base.yaml", 1, 1)
    assert await editor.definition(SCENARIO.replace("asked: asked +", "asked: ask^ed +")) == (
        "heir.yaml",
        8,
        11,
    )


async def formats(editor: Editor) -> None:
    await editor.change(SCENARIO.replace("params: {", "params:   { "))
    options = lsp.FormattingOptions(tab_size=2, insert_spaces=True)
    params = lsp.DocumentFormattingParams(lsp.TextDocumentIdentifier(editor.uri), options)
    (edit,) = await editor.client.text_document_formatting_async(params) or ()
    assert edit.new_text == SCENARIO
    await editor.change("scenario: [")
    assert await editor.client.text_document_formatting_async(params) is None


def test_without_pygls_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from socialai_dsl.cli.main import main

    monkeypatch.setitem(sys.modules, "pygls.lsp.server", None)
    monkeypatch.delitem(sys.modules, "socialai_dsl.authoring.server", raising=False)
    assert main(["lsp"]) == 2
    assert "pip install 'socialai-dsl[lsp]'" in capsys.readouterr().err
