"""The opened folder: nothing outside of it is read or written, and nothing typed is lost."""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from socialai_dsl.cli.main import main
from socialai_dsl.studio.drafts import Drafts
from socialai_dsl.studio.files import ConflictError, FileError, Folder, digest

_NOBODY: Final = 65534


WINDOW, OTHER, THIRD = "0" * 16, "1" * 16, "2" * 16
OUTSIDE = "../secret.yaml|link.yaml|up/secret.yaml|/etc/passwd|/tmp/x.yaml|more/../../secret.yaml|new.yaml"
NO_NAME = (
    "notes.txt|notes.yaml|.studio/x.yaml|.hidden/x.yaml|hidden.yaml|.x.yaml|.yaml|more/.x.yaml|more//two.yml|./one.yaml"
    "|loop.yaml|a\0.yaml|a\nb.yaml|a\rb.yaml|a\tb.yaml|a\x1bb.yaml|a\u2028b.yaml|a\u202eb.yaml|a\ud800.yaml|a\\b.yaml"
    "| a.yaml|more/a /x.yaml|one.YAML|more||.|..|/"
)


def test_scenarios_are_those_inside(root: Path) -> None:
    assert sorted(Folder(root).scenarios()) == ["more/two.yml", "one.yaml"]


def everything(folder: Path) -> dict[str, bytes | str]:
    """All that lies in a folder, by name: what a file holds, where a link leads."""
    return {
        str(path.relative_to(folder)): str(path.readlink()) if path.is_symlink() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


OPERATIONS: dict[str, Callable[[Folder, str], object]] = {
    "read": lambda folder, name: folder.read(name),
    "open": lambda folder, name: folder.open(name, WINDOW, ()),
    "write": lambda folder, name: folder.write(name, "x", None, WINDOW),
    "write over": lambda folder, name: folder.write(name, "x", None, WINDOW, over=True),
    "create": lambda folder, name: folder.create(name, "x", WINDOW),
    "keep_draft": lambda folder, name: folder.keep_draft(name, "x", None, WINDOW),
    "forget_draft": lambda folder, name: folder.forget_draft(name, WINDOW),
    "take_draft": lambda folder, name: folder.take_draft(name, OTHER, WINDOW, ()),
    "discard_draft": lambda folder, name: folder.discard_draft(name, OTHER, ()),
}


@pytest.mark.parametrize("operation", OPERATIONS)
def test_every_operation_refuses_what_may_not_be_a_name(root: Path, operation: str) -> None:
    before = everything(root.parent)
    for name in (*OUTSIDE.split("|"), *NO_NAME.split("|"), "a" * 196 + ".yaml", "a/" * 500 + "a.yaml"):
        with pytest.raises(FileError) as refused:
            OPERATIONS[operation](Folder(root), name)
        assert len(str(refused.value)) < 250
        assert str(refused.value).isprintable()
    assert everything(root.parent) == before


@pytest.mark.parametrize(
    "name", ["two words.yaml", "größe.yaml", "a.b.yml", "more/three.yaml", "a" * 195 + ".yaml"]
)
def test_other_names_are_created_listed_kept_and_saved(root: Path, name: str) -> None:
    folder = Folder(root)
    assert folder.create(name, "scenario: new\n", WINDOW) == name
    assert name in folder.scenarios()
    folder.keep_draft(name, "typed", None, WINDOW)
    found = folder.open(name, WINDOW, ())
    assert found.draft is not None
    assert found.draft.text == "typed"
    folder.write(name, "typed", found.digest, WINDOW)
    assert folder.read(name)[0] == "typed"


def test_a_link_to_a_scenario_of_the_folder_is_written_through(root: Path) -> None:
    (root / "other.yaml").symlink_to("one.yaml")
    folder = Folder(root)
    folder.write("other.yaml", "scenario: mine\n", folder.read("other.yaml")[1], WINDOW)
    assert (root / "other.yaml").is_symlink()
    assert (root / "one.yaml").read_text() == "scenario: mine\n"


@pytest.mark.parametrize("what", ["folder", "file", "pipe", "temporary"])
def test_drafts_follow_no_link(root: Path, what: str) -> None:
    outside = root.parent / "outside"
    outside.mkdir()
    folder = Folder(root)
    folder.keep_draft("one.yaml", "typed", None, WINDOW)
    (draft,) = (root / ".studio").iterdir()
    held = draft.read_text()
    if what == "folder":
        (root / ".studio").rename(outside / "drafts")
        (root / ".studio").symlink_to(outside / "drafts")
    elif what == "file":
        draft.rename(outside / draft.name)
        draft.symlink_to(outside / draft.name)
    elif what == "pipe":
        draft.unlink()
        os.mkfifo(draft)
    else:
        (outside / "target").write_text("theirs")
        draft.with_name(f".{draft.name}.{os.getpid()}-{threading.get_ident()}").symlink_to(outside / "target")
    before = everything(outside)
    found = folder.open("one.yaml", WINDOW, ())
    assert (found.draft is not None) == (what == "temporary"), "what a link leads to is not shown"
    if what == "folder":
        with pytest.raises(FileError, match=r"the draft cannot be kept: \.studio is no folder"):
            folder.keep_draft("one.yaml", "more", None, WINDOW)
        folder.write("one.yaml", "scenario: mine\n", found.digest, WINDOW)
    else:
        folder.keep_draft("one.yaml", "more", None, WINDOW)
        assert draft.is_file()
        assert not draft.is_symlink()
        assert '"more"' in draft.read_text() != held
    assert everything(outside) == before


@pytest.mark.parametrize("content", [b"", b"\xff", b"{}", b"[" * 9999, b'{"name": 3}', b"null"])
def test_a_damaged_draft_is_left_alone(root: Path, content: bytes) -> None:
    folder = Folder(root)
    folder.keep_draft("one.yaml", "typed", None, OTHER)
    (draft,) = (root / ".studio").iterdir()
    draft.write_bytes(content)
    assert folder.open("one.yaml", WINDOW, ()).draft is None
    assert draft.read_bytes() == content


def test_saving_keeps_who_may_read_a_file(root: Path) -> None:
    folder, file = Folder(root), root / "one.yaml"
    file.chmod(0o600)
    folder.write("one.yaml", "scenario: mine\n", folder.read("one.yaml")[1], WINDOW)
    assert file.stat().st_mode & 0o777 == 0o600
    folder.keep_draft("one.yaml", "typed", None, WINDOW)
    assert (root / ".studio").stat().st_mode & 0o077 == 0


def test_two_windows_do_not_write_over_each_other(root: Path) -> None:
    folder = Folder(root)
    _, known = folder.read("one.yaml")
    first = folder.write("one.yaml", "scenario: mine\n", known, WINDOW)
    with pytest.raises(ConflictError, match="changed elsewhere"):
        folder.write("one.yaml", "scenario: theirs\n", known, OTHER)
    with pytest.raises(ConflictError):
        folder.write("one.yaml", "scenario: new\n", None, OTHER)
    assert folder.read("one.yaml") == ("scenario: mine\n", first)
    assert folder.write("one.yaml", "scenario: mine\n", known, OTHER) == first, "nothing is written over"


def test_of_many_who_save_at_once_one_does_and_the_others_are_told(root: Path) -> None:
    folder = Folder(root)
    _, known = folder.read("one.yaml")

    def save(number: int) -> bool:
        try:
            folder.write("one.yaml", f"scenario: n{number}\n", known, f"{number:016x}")
        except ConflictError:
            return False
        return True

    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(save, range(40))) == 1
        names = list(pool.map(lambda number: folder.create("New.yaml", str(number), WINDOW), range(20)))
    assert len(set(names)) == 20


def test_a_draft_is_its_windows_until_that_saves(root: Path) -> None:
    folder = Folder(root)
    text, known = folder.read("one.yaml")
    folder.keep_draft("one.yaml", "mine", known, WINDOW)
    folder.keep_draft("one.yaml", "theirs", known, OTHER)
    both = (WINDOW, OTHER)
    for window, typed in zip(both, ("mine", "theirs"), strict=True):
        found = folder.open("one.yaml", window, both)
        assert (found.text, found.draft and found.draft.text, found.others, found.elsewhere) == (
            text,
            typed,
            [],
            1,
        )
    folder.write("one.yaml", "theirs", known, OTHER)
    found = folder.open("one.yaml", WINDOW, both)
    assert found.draft is not None
    assert (found.draft.text, found.draft.base, found.elsewhere) == ("mine", known, 0)
    assert found.draft.base != found.digest, "so that saving it asks first"


def test_a_new_window_goes_on_with_what_a_closed_one_had_typed_last_and_is_offered_the_rest(
    root: Path,
) -> None:
    folder = Folder(root)
    for typed, window in (("old", OTHER), ("new", THIRD)):
        folder.keep_draft("one.yaml", typed, None, window)
    found = folder.open("one.yaml", WINDOW, (WINDOW,))
    assert found.draft is not None
    assert found.draft.text == "new"
    assert [one.text for one in found.others] == ["old"]
    assert folder.take_draft("one.yaml", OTHER, WINDOW, (WINDOW,)).text == "old"
    found = folder.open("one.yaml", WINDOW, (WINDOW,))
    assert found.draft is not None
    assert found.draft.text == "old"
    (aside,) = found.others
    assert (aside.text, aside.aside) == ("new", True)
    another = folder.open("one.yaml", THIRD, (WINDOW, THIRD))
    assert (another.draft, another.others, another.elsewhere) == (None, [aside], 1)
    folder.discard_draft("one.yaml", aside.window, (WINDOW, THIRD))
    assert folder.open("one.yaml", THIRD, (WINDOW, THIRD)).others == []
    for gone in (aside.window, WINDOW):
        with pytest.raises(FileError, match="no such draft"):
            folder.discard_draft("one.yaml", gone, (WINDOW, THIRD))


def test_what_is_written_over_is_kept(root: Path) -> None:
    folder = Folder(root)
    (root / "one.yaml").write_text("by another program\n")
    folder.write("one.yaml", "mine\n", "what was there", WINDOW, over=True)
    found = folder.open("one.yaml", OTHER, (OTHER,))
    assert (found.text, found.draft, [one.text for one in found.others]) == (
        "mine\n",
        None,
        ["by another program\n"],
    )


def test_the_draft_of_a_file_that_is_gone_is_found(root: Path) -> None:
    folder = Folder(root)
    folder.keep_draft("one.yaml", "typed", folder.read("one.yaml")[1], OTHER)
    (root / "one.yaml").unlink()
    assert "one.yaml" in folder.scenarios()
    found = folder.open("one.yaml", WINDOW, (WINDOW,))
    assert (found.text, found.digest, found.draft and found.draft.text) == ("", None, "typed")


def test_what_is_saved_has_no_draft(root: Path) -> None:
    folder = Folder(root)
    text, known = folder.read("more/two.yml")
    folder.keep_draft("more/two.yml", text, known, OTHER)
    assert folder.open("more/two.yml", WINDOW, ()).draft is None
    assert not list((root / ".studio").iterdir())


class Typists(RuleBasedStateMachine):
    """Windows that come and go, type and save: the last text of each is in a file, in a draft, or was given up."""

    def __init__(self) -> None:
        super().__init__()
        self.place = tempfile.TemporaryDirectory()
        self.root = Path(self.place.name)
        (self.root / "a.yaml").write_text("first")
        self.folder = Folder(self.root)
        self.windows: dict[str, tuple[str, str | None]] = {}
        """Of each open window its text, and the digest of the file that it was begun with."""
        self.typed = {"first"}
        self.number = 0

    def teardown(self) -> None:
        self.place.cleanup()

    @rule()
    @precondition(lambda self: len(self.windows) < 3)
    def open(self) -> None:
        self.number += 1
        window = f"{self.number:016x}"
        found = self.folder.open("a.yaml", window, {*self.windows, window})
        draft = found.draft
        self.windows[window] = (draft.text, draft.base) if draft else (found.text, found.digest)

    @rule(data=st.data())
    @precondition(lambda self: self.windows)
    def type(self, data: st.DataObject) -> None:
        window = data.draw(st.sampled_from(sorted(self.windows)))
        self.number += 1
        text = f"text {self.number}"
        self.typed -= {self.windows[window][0]} - self.texts(but=window)
        self.typed.add(text)
        self.folder.keep_draft("a.yaml", text, self.windows[window][1], window)
        self.windows[window] = (text, self.windows[window][1])

    @rule(data=st.data(), over=st.booleans())
    @precondition(lambda self: self.windows)
    def save(self, data: st.DataObject, over: bool) -> None:
        window = data.draw(st.sampled_from(sorted(self.windows)))
        text, base = self.windows[window]
        before = (self.root / "a.yaml").read_text()
        try:
            known = self.folder.write("a.yaml", text, base, window, over)
        except ConflictError:
            assert not over
            assert digest(before) != base
            return
        if digest(before) == base:  # seen, and given up
            self.typed -= {before} - self.texts(but=window) - {text}
        self.windows[window] = (text, known)

    @rule(data=st.data())
    @precondition(lambda self: self.windows)
    def close(self, data: st.DataObject) -> None:
        self.windows.pop(data.draw(st.sampled_from(sorted(self.windows))))

    @rule(data=st.data())
    @precondition(lambda self: self.windows)
    def take(self, data: st.DataObject) -> None:
        window = data.draw(st.sampled_from(sorted(self.windows)))
        found = self.folder.open("a.yaml", window, self.windows, adopt=False)
        if found.others:
            draft = data.draw(st.sampled_from(found.others))
            taken = self.folder.take_draft("a.yaml", draft.window, window, self.windows)
            self.windows[window] = (taken.text, taken.base)

    def texts(self, but: str = "") -> set[str]:
        """What is in the file and in drafts of others than a window."""
        drafts = [one for one in Drafts(self.root).of("a.yaml") if one.window != but]
        return {(self.root / "a.yaml").read_text(), *(one.text for one in drafts)}

    @invariant()
    def nothing_typed_is_lost(self) -> None:
        assert self.typed <= self.texts()


TestTypists = pytest.mark.filterwarnings("default")(Typists.TestCase)
TestTypists.settings = settings(max_examples=25, stateful_step_count=20, derandomize=True, deadline=None)


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_a_text_whose_lines_end_otherwise_is_not_taken_for_a_change_of_it(root: Path, end: str) -> None:
    """Editors on pages end lines by a line feed, whatever the file does."""
    text = "scenario: one\nhorizon: 5\n"
    (root / "one.yaml").write_bytes(text.replace("\n", end).encode())
    folder = Folder(root)
    assert folder.read("one.yaml")[0] == text
    folder.keep_draft("one.yaml", text, folder.read("one.yaml")[1], OTHER)
    opened = folder.open("one.yaml", WINDOW, ())
    assert (opened.text, opened.draft, opened.others) == (text, None, [])
    folder.write("one.yaml", text + "# more\n", opened.digest, WINDOW)


def test_what_is_no_text_is_told_in_words(root: Path) -> None:
    (root / "binary.yaml").write_bytes(b"\x00\x01\x02" * 50)
    (root / "large.yaml").write_bytes(b"a" * (5 << 20))
    folder = Folder(root)
    with pytest.raises(FileError, match=r"binary|UTF-16"):
        folder.read("binary.yaml")
    with pytest.raises(FileError, match="larger than"):
        folder.read("large.yaml")
    with pytest.raises(FileError, match="larger than"):
        folder.write("one.yaml", "a" * (5 << 20), folder.read("one.yaml")[1], WINDOW)


@contextmanager
def as_another_user() -> Iterator[Path]:
    """A folder of a user who may do no more than its files' modes say, which root could ignore."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        is_root = os.geteuid() == 0
        if is_root:
            os.chown(root, _NOBODY, _NOBODY)
        for file, mode in (("secret.yaml", 0o000), ("theirs.yaml", 0o444)):
            (root / file).write_text("scenario: one\n")
            (root / file).chmod(mode)
        if is_root:
            os.setresuid(_NOBODY, _NOBODY, 0)
        try:
            yield root
        finally:
            if is_root:
                os.setresuid(0, 0, 0)
            root.chmod(0o755)


def test_files_of_another_user_are_refused_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["studio", "none", "--no-browser"]) == 2  # everything is imported before the user changes
    with as_another_user() as root:
        folder = Folder(root)
        with pytest.raises(FileError, match=r"secret.yaml: .*permission denied"):
            folder.read("secret.yaml")
        text, known = folder.read("theirs.yaml")
        with pytest.raises(FileError, match="this user may not write"):
            folder.write("theirs.yaml", text + "# mine\n", known, WINDOW)
        folder.keep_draft("theirs.yaml", text + "# mine\n", known, OTHER)
        (root / ".studio").chmod(0o500)
        found = folder.open("theirs.yaml", WINDOW, ())  # though it cannot be made this window's
        assert found.draft is not None
        assert found.draft.text == text + "# mine\n"
        (root / ".studio").chmod(0o700)
        shutil.rmtree(root / ".studio")
        root.chmod(0o555)
        with pytest.raises(FileError, match="cannot be written: Permission denied"):
            folder.create("new.yaml", text, WINDOW)
        with pytest.raises(FileError, match="the draft cannot be kept: Permission denied"):
            folder.keep_draft("theirs.yaml", "typed", None, WINDOW)
        assert folder.scenarios() == ["secret.yaml", "theirs.yaml"]
        root.chmod(0o000)
        assert main(["studio", str(root), "--no-browser"]) == 2
    assert "Permission denied" in capsys.readouterr().err


def test_copies_take_a_free_name(root: Path) -> None:
    folder = Folder(root)
    assert folder.create("one.yaml", "scenario: one\n", WINDOW) == "one_2.yaml"
    assert folder.create("ONE.yaml", "scenario: one\n", WINDOW) == "ONE_3.yaml", (
        "some file systems know no case"
    )
    assert folder.create("u\u0308.yaml", "scenario: one\n", WINDOW) == "u\u0308.yaml"
    assert folder.create("\u00fc.yaml", "scenario: one\n", WINDOW) == "\u00fc_2.yaml"
