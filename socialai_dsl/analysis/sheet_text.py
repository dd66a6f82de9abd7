"""Parts of a scenario as lines of Markdown."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from socialai_dsl.schema.annotations import keys_of
from socialai_dsl.schema.scenario import DOES, FirstRule

_CONDITIONS: Final = tuple(key for key in keys_of(FirstRule) if key not in (*DOES, "id"))


def code(text: object) -> str:
    """As code; nothing for an empty text."""
    return f"`{text}`" if str(text) else ""


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table; columns that are empty in all rows are left out. Bars of expressions must not end a cell."""
    rows = list(rows)
    kept = [i for i in range(len(columns)) if any(row[i] for row in rows)]
    lines = [[row[i].replace("|", "\\|") for i in kept] for row in rows]
    lines = [[columns[i] for i in kept], ["---"] * len(kept), *lines]
    return ["|" + "".join(f" {cell} |" if cell else " |" for cell in cells) for cells in lines]


def flow(value: Any) -> str:
    """A value as it would stand in the file, on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow(part) for part in value) + "]"
    return str(value)


def entries(mapping: Mapping[str, Any], without: Iterable[str] = ()) -> str:
    """The keys of a mapping with their values, each as code."""
    return ", ".join(code(f"{key}: {flow(value)}") for key, value in mapping.items() if key not in without)


def items(mapping: Mapping[str, Any]) -> list[str]:
    """A list with one line for each key."""
    return [f"* {code(f'{key}: {flow(value)}')}" for key, value in mapping.items()]


def rule(content: Mapping[str, Any]) -> str:
    """Conditions, an arrow, effects."""
    conditions = {key: content[key] for key in _CONDITIONS if key in content}
    effects = entries(content, (*_CONDITIONS, "id"))
    return f"{entries(conditions)} → {effects}" if conditions and effects else entries(conditions) or effects


def frame(name: str, content: Mapping[str, Any]) -> list[str]:
    """A frame as a table of its states or a list of its steps, with what it declares before."""
    lines = [f"### {code(name)}", ""]
    for key in ("slots", "let", "define"):
        if content.get(key):
            lines.append(f"* {key}: {entries(content[key])}")
    if content.get("start"):
        lines.append(f"* starts in {code(content['start'])}")
    lines += [""] if lines[-1] else []
    if content.get("steps"):
        steps = content["steps"] if isinstance(content["steps"], list) else [content["steps"]]
        return lines + [f"{number}. {entries(step)}" for number, step in enumerate(steps, 1)]
    rows = [
        (
            code(state),
            "<br>".join(map(rule, _list(parts.get("first")))),
            code(parts.get("do", "stay")),
            "<br>".join(map(rule, _list(parts.get("then")))),
        )
        for state, parts in ((state, parts or {}) for state, parts in (content.get("states") or {}).items())
    ]
    return lines + table(("state", "noticed before moving", "does", "noticed after moving"), rows)


def _list(value: Any) -> list[Any]:
    if value is None:
        return []
    return value if isinstance(value, list) else [value]
