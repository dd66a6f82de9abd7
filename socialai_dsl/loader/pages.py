"""The pages about the codes of findings."""

from pathlib import Path

from socialai_dsl.diagnostics import CODES, suggested
from socialai_dsl.errors import UsageError


def page_of(typed: str) -> str:
    """The page about a code, as Markdown.

    Raises:
        UsageError: there is no such code.
    """
    code = typed.upper()
    if code not in CODES:
        hint = suggested(code, CODES, "; `socialai explain` lists all codes")
        raise UsageError(f"CODE: there is no {typed!r}{hint}")
    return (_folder() / f"{code}.md").read_text(encoding="utf-8")


def _folder() -> Path:
    """Where the pages are, in a checkout as well as installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "pages"
    return installed if installed.is_dir() else package.parent / "docs" / "diagnostics"
