"""Machine code is made once, loaded without Numba, and made anew where what lies on the disk is damaged."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from socialai_dsl.engine import cache, machine, settings

pytestmark = pytest.mark.skipif(settings.is_interpreted(), reason="nothing is compiled")

START = """
import sys
import socialai_dsl as sd
envs = sd.make_vec("talkitout", num_envs=2)
envs.reset(seed=1)
image = envs.step([[2, 1, 0, 0]] * 2)[0]["image"]
print(image.tobytes().hex(), *envs.image_ids(), "numba" in sys.modules)
"""


def python(code: str, **environment: str) -> list[str]:
    """What a new process prints, by words."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**clean, **environment},
        timeout=300,
        check=False,
    )
    assert (result.returncode, result.stderr) == (0, ""), result.stderr
    return result.stdout.split()


def load(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Load code as a new process does."""
    monkeypatch.setattr(machine, "_addresses", {})
    machine._load(name)


def test_code_from_the_disk_needs_no_compiler() -> None:
    first = python(START)  # so that it is there
    assert python(START) == [*first[:-1], "False"]


def test_damaged_code_is_made_anew_and_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Compiled:
        def object_code(self) -> bytes:
            return b"sound code"

    loaded: list[bytes] = []
    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(machine, "_separate", lambda name: Compiled())
    monkeypatch.setattr(machine, "load_object", lambda symbol, code: loaded.append(code) or 1)
    load("serve", monkeypatch)
    sound = (tmp_path / "serve").read_bytes()
    (tmp_path / "serve").write_bytes(sound[:-1])
    load("serve", monkeypatch)
    assert (tmp_path / "serve").read_bytes() == sound
    monkeypatch.setattr(machine, "_separate", lambda name: pytest.fail("it was there"))
    load("serve", monkeypatch)
    assert loaded == [b"sound code"] * 3


@pytest.mark.parametrize("helps", [True, False])
def test_a_helper_makes_the_other_half_or_it_is_made_here(
    helps: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    loaded: list[bytes] = []

    class Separate:
        def __init__(self, name: str) -> None:
            self.name = name

        def object_code(self) -> bytes:
            made.append(self.name)
            return self.name.encode()

    class Helper:
        def __init__(self, name: str) -> None:
            self.name = name

        def wait(self) -> None:
            if helps:
                cache.keep(self.name, b"made by the helper")

    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(machine, "_addresses", {})
    monkeypatch.setattr(machine, "_separate", Separate)
    monkeypatch.setattr(machine, "Helper", Helper)
    monkeypatch.setattr(machine, "load_object", lambda symbol, code: loaded.append(code) or len(loaded))
    assert machine._load("interpreter", "serve") == 2
    assert made == (["interpreter"] if helps else ["interpreter", "serve"])
    assert loaded == [b"interpreter", b"made by the helper" if helps else b"serve"]
    assert machine._load("interpreter", "serve") == 2
    assert len(loaded) == 2, "what is loaded is not loaded again"


def test_threads_that_start_at_once_load_it_once(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []

    def load_slowly(symbol: str, code: bytes) -> int:
        time.sleep(0.05)
        loaded.append(symbol)
        return 1

    monkeypatch.setattr(machine, "_addresses", {})
    monkeypatch.setattr(machine, "read", lambda name: b"code")
    monkeypatch.setattr(machine, "load_object", load_slowly)
    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(machine._load, ["serve"] * 4)) == [1] * 4
    assert loaded == [machine.symbol_of("serve")]


def test_settings_are_read_without_numba_where_none_is_set() -> None:
    """What we take Numba's settings to be is what they are, so code is found whether Numba is loaded or not."""
    code = """
from socialai_dsl.engine.settings import settings
before = settings()
import numba
print(before == settings(), before["OPT"])
"""
    assert python(code) == ["True", "_OptLevel(3)"]
    assert python(code, NUMBA_OPT="1") == ["True", "_OptLevel(1)"]
