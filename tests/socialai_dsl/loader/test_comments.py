"""Comments are found where YAML has them, and nowhere else."""

from socialai_dsl.loader.comments import comments_of
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source

TEXT = """\
# first
a: "no # comment"   # second
b: 'nor # this'
c#d: e#f            # third
"g # h": |          # fourth
  text # no comment
  more
  # neither

# fifth
i: long
  plain # sixth
j: [x,  # seventh
  z]
"""


def test_comments() -> None:
    found = comments_of(read_document(Source("a.yaml", TEXT)))
    assert [comment.text for comment in found] == [
        f"# {word}" for word in "first second third fourth fifth sixth seventh".split()
    ]
    assert [comment.alone for comment in found] == [True, False, False, False, True, False, False]
    lines = TEXT.splitlines()
    for comment in found:
        start = comment.span.column - 1
        assert lines[comment.span.line - 1][start : start + comment.span.width] == comment.text


def test_an_empty_file_has_its_comments() -> None:
    found = comments_of(read_document(Source("a.yaml", "  # only this\r\n")))
    assert [(comment.text, comment.span.line, comment.span.column) for comment in found] == [
        ("# only this", 1, 3)
    ]
