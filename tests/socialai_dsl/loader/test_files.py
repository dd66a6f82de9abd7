"""Reading files nobody vouches for."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.reader import MAX_FILE_BYTES, display_name, read_document


def finding(path: Path) -> str:
    start = time.perf_counter()
    with pytest.raises(ScenarioError) as raised:
        read_document(path, "f")
    # Against hanging; how fast it is a benchmark's business.
    assert time.perf_counter() - start < 20.0
    assert str(raised.value)
    return str(raised.value.diagnostics[0])


CONTENTS = {
    "utf-16 with mark": ("a: é".encode("utf-16"), "S006"),
    "utf-16 without mark": ("abc: def".encode("utf-16-le"), "S006"),
    "utf-32": ("abc: def".encode("utf-32"), "S006"),
    "latin-1": ("a: ok\nb: caf\xe9".encode("latin-1"), "2:7: S006"),
    "cut character": ("a: é".encode()[:-1], "1:4: S006"),
    "overlong": (b"a: \xc0\xaf", "1:4: S006"),
    "encoded surrogate": (b"a: \xed\xa0\x80", "1:4: S006"),
    "nul": (b"a: b\x00c d e f g", "1:5: S006"),
    "escape": (b"a: \x1b[31m", "1:4: S006"),
    "bidi": ("a: x\u202ey".encode(), "1:5: S006"),
    "second mark": ("\ufeff\ufeffa: 1".encode(), "1:1: S006"),
    "png": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00abcdefghijklmnopqrstuvwxyz", "1:1: S007"),
    "too large": (b"a: b\n" * 300_000, "1:1: S004"),
}


@pytest.mark.parametrize("name", CONTENTS)
def test_contents(name: str, tmp_path: Path) -> None:
    content, expected = CONTENTS[name]
    (tmp_path / "f.yaml").write_bytes(content)
    assert expected in finding(tmp_path / "f.yaml")


def test_one_byte_order_mark_is_dropped_without_shifting_columns(tmp_path: Path) -> None:
    file = tmp_path / "f.yaml"
    file.write_bytes("\ufeffa: 1\n".encode())
    document = read_document(file)
    assert document.data == {"a": 1}
    assert document.key_span(("a",)).column == 1


def test_the_size_limit_is_exact(tmp_path: Path) -> None:
    file = tmp_path / "f.yaml"
    file.write_bytes(b"#" * MAX_FILE_BYTES)
    assert read_document(file).data is None
    file.write_bytes(b"#" * (MAX_FILE_BYTES + 1))
    assert "S004" in finding(file)


def test_what_is_no_file(tmp_path: Path) -> None:
    assert "S007 there is no such file" in finding(tmp_path / "none.yaml")
    assert "S007 this is a folder" in finding(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    assert "S007 this is a pipe" in finding(tmp_path / "pipe")
    assert "S007 this is a device" in finding(Path("/dev/zero"))
    (tmp_path / "loop").symlink_to("loop")
    assert "S007 the file cannot be opened" in finding(tmp_path / "loop")
    assert "S007 the file cannot be opened" in finding(Path("a\0b"))
    assert "S007 the file cannot be opened" in finding(Path("a" * 5000))


def test_names_are_relative_to_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert display_name(tmp_path / "a" / "b.yaml") == "a/b.yaml"
    assert display_name(Path("a/../b.yaml")) == "b.yaml"
    assert display_name(tmp_path.parent / "c.yaml") == str(tmp_path.parent / "c.yaml")


def test_a_hostile_file_name_is_shown_escaped(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as raised:
        read_document(tmp_path / "\x1b]0;x\x07\n::error::.yaml")
    assert str(raised.value).isprintable()
