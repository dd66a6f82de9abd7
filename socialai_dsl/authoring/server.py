"""The language server, over the Language Server Protocol."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path

from socialai_dsl import frontend
from socialai_dsl.authoring import assist
from socialai_dsl.authoring.formatting import formatted
from socialai_dsl.diagnostics import Diagnostic, ScenarioError, Severity
from socialai_dsl.loader.reader import display_name, followed, read_document
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.source import Node, Source, Span, TextEdit

_SEVERITIES: Final = {
    Severity.ERROR: lsp.DiagnosticSeverity.Error,
    Severity.WARNING: lsp.DiagnosticSeverity.Warning,
}
_KINDS: Final = {
    "key": lsp.CompletionItemKind.Property,
    "name": lsp.CompletionItemKind.Variable,
    "verb": lsp.CompletionItemKind.Function,
    "word": lsp.CompletionItemKind.EnumMember,
    "file": lsp.CompletionItemKind.File,
}


class Server(LanguageServer):
    """Checks open files as they are in the editor, and remembers how each last could be read."""

    def __init__(self) -> None:
        super().__init__("socialai", version("socialai-dsl"))
        self._resolved: dict[str, ResolvedFile] = {}
        self._cures: dict[str, list[lsp.CodeAction]] = {}

    # -- findings ----------------------------------------------------------------------------------------------

    def check_open(self) -> None:
        """Check all open files, since one may build on another, and publish what is found."""
        for uri in list(self.workspace.text_documents):
            self._publish(uri, self._check(uri))

    def forget(self, uri: str) -> None:
        """Take the findings of a file back that is closed."""
        self._resolved.pop(uri, None)
        self._cures.pop(uri, None)
        self._publish(uri, [])

    def _publish(self, uri: str, found: list[lsp.Diagnostic]) -> None:
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri=uri, diagnostics=found))

    def _check(self, uri: str) -> list[lsp.Diagnostic]:
        path = path_of(uri)
        texts = {path_of(other): self.source(other) for other in self.workspace.text_documents}
        result = frontend.check(path, texts)
        if (whole := result.whole) is not None:
            self._resolved[uri] = whole
        found = [self._finding(uri, d, display_name(path)) for d in result.diagnostics]
        self._cures[uri] = [
            self._cure(d, shown, result.sources)
            for d, shown in zip(result.diagnostics, found, strict=True)
            if d.edits
        ]
        return found

    def _finding(self, uri: str, found: Diagnostic, own: str) -> lsp.Diagnostic:
        message = found.text if found.help is None else f"{found.text}\n{found.help}"
        span = found.span
        if span.file != own:  # what is wrong with a file that this one uses is shown at its top
            message, span = f"{span}: {message}", Span(own, 1, 1)
        return lsp.Diagnostic(
            range=self.range(uri, span),
            message=message,
            severity=_SEVERITIES[found.severity],
            code=found.code,
            source="socialai",
        )

    def _cure(
        self, found: Diagnostic, shown: lsp.Diagnostic, sources: Mapping[str, Source]
    ) -> lsp.CodeAction:
        changes: dict[str, list[lsp.TextEdit]] = {}
        for edit in found.edits:
            source = sources[edit.span.file]
            assert source.path is not None, "internal: what is to be changed is a file"
            uri = next(
                (uri for uri in self.workspace.text_documents if path_of(uri) == source.path),
                from_fs_path(str(source.path)) or "",
            )
            changes.setdefault(uri, []).append(lsp.TextEdit(self._range_of(edit, source), edit.text))
        title = found.cure[0].upper() + found.cure[1:]
        return lsp.CodeAction(
            title=title,
            kind=lsp.CodeActionKind.QuickFix,
            diagnostics=[shown],
            edit=lsp.WorkspaceEdit(changes=changes),
        )

    def _range_of(self, edit: TextEdit, source: Source) -> lsp.Range:
        """The place of a change, which may be several lines, as the editor counts."""
        codec, lines = self.workspace.position_codec, [line + "\n" for line in source.lines()]
        places = (lsp.Position(span.line - 1, span.column - 1) for span in source.ends(edit))
        return lsp.Range(*(codec.position_to_client_units(lines, place) for place in places))

    def cures(self, uri: str, wanted: lsp.Range) -> list[lsp.CodeAction]:
        """The cures of what is found in a range of a file."""
        return [
            cure
            for cure in self._cures.get(uri, [])
            for shown in cure.diagnostics or ()
            if shown.range.start <= wanted.end and wanted.start <= shown.range.end
        ]

    # -- the file that is asked about --------------------------------------------------------------------------

    def source(self, uri: str) -> Source:
        """The text of a file as it is in the editor."""
        path = path_of(uri)
        return Source(display_name(path), self.workspace.get_text_document(uri).source, path)

    def document(self, uri: str) -> Node | None:
        """The file as it is in the editor; None if it is not YAML."""
        try:
            return read_document(self.source(uri))
        except ScenarioError:
            return None

    def resolved(self, uri: str) -> ResolvedFile | None:
        """The file with everything it builds on, or the scenario of a file of tests, as it last could be read."""
        return self._resolved.get(uri)

    def place(self, uri: str, position: lsp.Position) -> tuple[int, int]:
        """Line and column, from 1, of a position, whose characters the editor counts in its own way."""
        lines = self._lines(uri)
        if position.line >= len(lines):
            return position.line + 1, 1
        own = self.workspace.position_codec.position_from_client_units(lines, position)
        return own.line + 1, own.character + 1

    def range(self, uri: str, span: Span) -> lsp.Range:
        """A place as the editor counts, no part of it behind the end of a line: editors refuse one behind the text."""
        codec, lines = self.workspace.position_codec, [*self.source(uri).lines()]
        line, start = span.line - 1, span.column - 1
        if line >= len(lines):
            line, start = len(lines) - 1, len(lines[-1])
        first, last = (
            codec.position_to_client_units(lines, lsp.Position(line, start + shift))
            for shift in (0, span.width)
        )
        return lsp.Range(first, last)

    def _lines(self, uri: str) -> list[str]:
        return [line + "\n" for line in Source("", self.workspace.get_text_document(uri).source).lines()]


def path_of(uri: str) -> Path:
    """The file of a URI; one that is not saved yet is taken to be in the working directory."""
    path = to_fs_path(uri) if uri.startswith("file:") else None
    return followed(Path(path or "unsaved.yaml"))


def make_server() -> Server:
    """The server with everything it answers."""
    server = Server()

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    @server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)
    def changed(ls: Server, params: Any) -> None:
        del params
        ls.check_open()

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(ls: Server, params: lsp.DidCloseTextDocumentParams) -> None:
        ls.forget(params.text_document.uri)

    server.feature(lsp.TEXT_DOCUMENT_HOVER)(hover)
    server.feature(lsp.TEXT_DOCUMENT_DEFINITION)(definition)
    server.feature(
        lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", "$", "(", "<", " "])
    )(completion)
    server.feature(lsp.TEXT_DOCUMENT_FORMATTING)(formatting)
    server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    )(cures)
    return server


def hover(ls: Server, params: lsp.HoverParams) -> lsp.Hover | None:
    """The meaning of the word under the cursor."""
    uri = params.text_document.uri
    document = ls.document(uri)
    if document is None:
        return None
    resolved = ls.resolved(uri)
    data = resolved.data if resolved is not None else document.data
    found = assist.explain(document, data, *ls.place(uri, params.position))
    if found is None:
        return None
    about, cursor = found
    content = lsp.MarkupContent(kind=lsp.MarkupKind.Markdown, value=about)
    return lsp.Hover(contents=content, range=ls.range(uri, cursor.span))


def definition(ls: Server, params: lsp.DefinitionParams) -> lsp.Location | None:
    """Where the word under the cursor is declared, perhaps in a file that this one builds on."""
    uri = params.text_document.uri
    document = ls.document(uri)
    if document is None:
        return None
    resolved = ls.resolved(uri)
    holder = resolved.tree if resolved is not None else document
    there = assist.declaration(document, holder.data, *ls.place(uri, params.position))
    if there is None:
        return None
    if isinstance(there, Path):
        start = lsp.Position(0, 0)
        return lsp.Location(from_fs_path(str(there)) or "", lsp.Range(start, start))
    path = holder.nearest(there).source.path
    target = from_fs_path(str(path)) if path is not None else uri
    target = uri if target is None or path_of(target) == path_of(uri) else target
    return lsp.Location(target, ls.range(target, holder.key_span(there)))


def completion(ls: Server, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    """The completions at the cursor."""
    uri = params.text_document.uri
    resolved = ls.resolved(uri)
    line, column = ls.place(uri, params.position)
    whole = resolved.data if resolved is not None else None
    offers = assist.complete(ls.source(uri).text, whole, path_of(uri).parent, line, column)
    return list(_items(offers))


def _items(offers: Iterable[assist.Offer]) -> Iterable[lsp.CompletionItem]:
    for number, offer in enumerate(offers):
        insert = f"{offer.text}: " if offer.kind == "key" else offer.text
        yield lsp.CompletionItem(
            label=offer.text,
            kind=_KINDS[offer.kind],
            detail=offer.about or None,
            insert_text=insert,
            sort_text=f"{number:04}",
        )


def cures(ls: Server, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
    """The changes that the findings at the cursor propose."""
    return ls.cures(params.text_document.uri, params.range)


def formatting(ls: Server, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit] | None:
    """The whole file in the house style; nothing for one that is not YAML."""
    uri = params.text_document.uri
    source = ls.source(uri)
    try:
        text = formatted(source)
    except ScenarioError:
        return None
    if text == source.text:
        return []
    end = lsp.Position(len(list(source.lines())), 0)
    return [lsp.TextEdit(lsp.Range(lsp.Position(0, 0), end), text)]
