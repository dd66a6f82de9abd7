"""Texts with a mark where the cursor is."""


def marked(text: str) -> tuple[str, int, int]:
    """The text without its `^`, and the line and column of that, from 1."""
    before, mark, after = text.partition("^")
    assert mark, "the text has no mark"
    return before + after, before.count("\n") + 1, len(before) - before.rfind("\n")
