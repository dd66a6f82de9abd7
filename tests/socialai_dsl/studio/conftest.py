from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _own_state(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Addresses are remembered in a folder of the test, not of the person who runs it."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A folder with two scenarios, and links that lead out of it."""
    folder = tmp_path / "work"
    (folder / "more").mkdir(parents=True)
    (folder / "one.yaml").write_text("scenario: one\n")
    (folder / "more" / "two.yml").write_text("scenario: two\n")
    (folder / "notes.txt").write_text("no")
    (folder / ".hidden").mkdir()
    (folder / ".hidden" / "x.yaml").write_text("scenario: x\n")
    (tmp_path / "secret.yaml").write_text("secret: true\n")
    (folder / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (folder / "up").symlink_to(tmp_path)
    (folder / "notes.yaml").symlink_to("notes.txt")
    (folder / "hidden.yaml").symlink_to(".hidden/x.yaml")
    (folder / "loop.yaml").symlink_to("loop.yaml")
    (folder / "new.yaml").symlink_to(tmp_path / "not_there.yaml")
    return folder
