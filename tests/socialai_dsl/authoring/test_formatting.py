"""The formatter changes white space alone, and nothing on a second run."""

from contextlib import suppress
from pathlib import Path
from random import Random

import pytest
import yaml

from socialai_dsl.authoring.formatting import formatted
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.comments import comments_of
from socialai_dsl.loader.reader import read_document
from socialai_dsl.source import Source
from tests.quick import one_in
from tests.socialai_dsl.authoring.documents import document

ROOT = Path(__file__).parents[3]
FILES = sorted(
    path
    for folder in ("scenarios", "socialai_dsl/cli/templates", "socialai_dsl/prelude")
    for path in (ROOT / folder).rglob("*.yaml")
)

UNTIDY = """


# top
scenario:   a   # beside
room:   {  size :  5..8,   width: [ 1,2 ] ,say: Who? }   #      aligned
list:
- a
-   b:  1
    c:   2
# about d
-
  d: 3

  # after d


  # before e
  e: 4
    # deep
-
    - x
    -   - z
text: |
       one
         two

# after text
fold:   >-
    a
    b

q: "x
     r  \\
     z"
p: plain
     more
# end of p
m:
        n:
                 o: [a,
                      b, {
                  c: d }
                      ]
                 # under o
        # under n
h: [   # beside a bracket
    a,
  # between
    b
]
k:
  v
? odd
: key"""

TIDY = """\
# top
scenario: a     # beside
room: {size: 5..8, width: [1, 2], say: Who?}             #      aligned
list:
  - a
  - b: 1
    c: 2
  # about d
  - d: 3

    # after d

    # before e
    e: 4
    # deep
  - - x
    - - z
text: |
  one
    two

# after text
fold: >-
  a
  b

q: "x
  r  \\
  z"
p: plain
  more
# end of p
m:
  n:
    o: [a,
        b, {
          c: d}
       ]
    # under o
  # under n
h: [   # beside a bracket
  a,
  # between
  b
]
k:
  v
? odd
: key
"""


def meaning(text: str) -> tuple[object, ...]:
    """The data, spelt out so that true is not 1, how its parts are written, and the comments in order."""
    read = read_document(Source("a.yaml", text))
    styles = {path: node.span.style for path, node in read.walk()}
    return repr(read.data), styles, [comment.text for comment in comments_of(read)]


def format_twice(text: str) -> str:
    once = formatted(Source("a.yaml", text))
    assert meaning(once) == meaning(text)
    assert formatted(Source("a.yaml", once)) == once, "a second run changes something"
    return once


def test_untidy() -> None:
    assert format_twice(UNTIDY) == TIDY


@pytest.mark.parametrize(
    "path", [path for path in FILES if path.name != "objects.yaml"], ids=lambda path: path.stem
)
def test_what_ships_is_in_this_style(path: Path) -> None:
    """But for the table of object types, which is laid out as one."""
    assert formatted(Source(path.name, path.read_text(encoding="utf-8"))) == path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ""),
        ("\n\n# only a comment", "# only a comment\n"),
        ("a:  1\r\nb:   2\r\n", "a: 1\nb: 2\n"),
        ("---\na:  1\n...\n", "---\na: 1\n...\n"),
        ("a: |+\n  x\n\n\n", "a: |+\n  x\n\n\n"),
        ("a: |+\n  x\n\n\nb: 1\n", "a: |+\n  x\n\n\nb: 1\n"),
        ("a: |\n  x\n\n\n\nb: 1\n", "a: |\n  x\n\nb: 1\n"),
        ("a: |\n    x", "a: |\n  x"),
        ("a:\n    - |2   # odd\n        x\n      y\n", "a:\n  - |2   # odd\n      x\n    y\n"),
        ('a:   "b\n\n   c"\n', 'a: "b\n\n  c"\n'),
        ("{a: 1,\nb: 2}\n", "{a: 1,\n b: 2}\n"),
        ("a: [1,2\n   ,3]\n", "a: [1, 2\n    , 3]\n"),
        ('{"a":1,"b":[]}', '{"a": 1, "b": []}\n'),
        ("- a\n-\n  # why\n  b: 1\n", "- a\n-\n  # why\n  b: 1\n"),
        ("a:\n# about b\n  b: 1\n", "a:\n  # about b\n  b: 1\n"),
        ("a:\t1\t# tab\n", "a: 1  # tab\n"),
        ("a:\t{b:\t1,\tc: 2\t}\t#\td\t\n", "a: {b: 1, c: 2}  #\td\n"),
        ("a: [#b\n1]#c\n", "a: [  #b\n  1]  #c\n"),
        ("a: \u3000 #b\n", "a: \u3000  #b\n"),
        ("a: |\n   \nb: 1\n", "a: |\n\nb: 1\n"),
    ],
)
def test_small_files(text: str, expected: str) -> None:
    assert format_twice(text) == expected


def untidied(text: str, random: Random) -> str:
    """A file with the same data in other white space, with more comments; changes that matter are left out."""
    data = read_document(Source("a.yaml", text)).data
    scale = random.choice((1, 1, 2, 3))
    lines = [" " * ((len(line) - len(line.lstrip())) * (scale - 1)) + line for line in text.split("\n")]
    made = "\n".join(lines)
    if not same(made, data):
        made = text
    for _ in range(25):
        place = random.randrange(len(made) + 1)
        put = random.choice(
            (
                "\n",
                " ",
                "  ",
                "\n\n\n",
                f"\n{' ' * random.randrange(9)}# more {place}\n",
                f"   # on {place}\n",
            )
        )
        changed = made[:place] + put + made[place:]
        if same(changed, data):
            made = changed
    return made.replace("\n", random.choice(("\n", "\n", "\r\n")))


def same(text: str, data: object) -> bool:
    try:
        return repr(read_document(Source("a.yaml", text)).data) == repr(data)
    except ScenarioError:
        return False


@pytest.mark.parametrize("seed", one_in(4, range(60), "formats many made-up files"))
def test_random_white_space(seed: int) -> None:
    random = Random(seed)
    path = random.choice([path for path in FILES if path.stat().st_size < 3_000])
    format_twice(untidied(path.read_text(encoding="utf-8"), random))


HOSTILE = (
    *("\t", " \t", "\n\t", "\t\n", "\r", "\r\n", "\u00a0", "\u3000", "\u2003", "\u200b", "'", "{", "]"),
    *("#", "\t#", "#\t\n", " #x\t\n", ":\t", ",\t", "-\t", "\t:", "\t? ", "|\t#c\n"),
)


def broken(text: str, random: Random) -> str:
    """A file with odd white space put where it may mean anything, or be a mistake."""
    for _ in range(random.choice((1, 1, 2, 4))):
        place = random.randrange(len(text) + 1)
        text = text[:place] + random.choice(HOSTILE) + text[place:]
    return text


@pytest.mark.parametrize("seed", one_in(4, range(200), "formats many made-up files"))
def test_hostile_white_space(seed: int) -> None:
    """What can be read is laid out, whatever stands between its words; all else is a mistake of the author."""
    random = Random(seed)
    path = random.choice([path for path in FILES if path.stat().st_size < 3_000])
    for text in (broken(path.read_text(encoding="utf-8"), random), broken(UNTIDY, random)):
        with suppress(ScenarioError):
            format_twice(text)


@pytest.mark.parametrize("seed", one_in(4, range(120), "formats many made-up files"))
def test_random_documents_in_other_styles(seed: int) -> None:
    random = Random(seed)
    Plain.style = random.choice((None, '"', "'", "|", ">"))
    text = yaml.dump(
        document(random),
        default_flow_style=random.choice((None, True, False)),
        indent=random.choice((2, 3, 4, 7)),
        width=random.choice((20, 60, 200)),
        sort_keys=False,
        allow_unicode=True,
        Dumper=Plain,
    )
    format_twice(text)


class Plain(yaml.SafeDumper):
    """Writes no aliases, and texts in one style, which those of one word that are keys keep to as well."""

    style: str | None = None

    def ignore_aliases(self, data: object) -> bool:
        return True

    def text(self, data: str) -> yaml.Node:
        return self.represent_scalar("tag:yaml.org,2002:str", data, style=self.style)


Plain.add_representer(str, Plain.text)


@pytest.mark.slow
def test_much_random_white_space() -> None:
    for seed in range(3_000):
        random = Random(seed)
        format_twice(untidied(random.choice(FILES).read_text(encoding="utf-8"), random))
