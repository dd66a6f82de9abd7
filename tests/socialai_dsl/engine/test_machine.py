"""Machine code is made once, loaded without Numba, and made anew where what lies on the disk is damaged."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from socialai_dsl.engine import settings
from socialai_dsl.engine.cache import cache_folder

pytestmark = pytest.mark.skipif(settings.is_interpreted(), reason="nothing is compiled")

START = """
import sys
import socialai_dsl as sd
envs = sd.make_vec("talkitout", num_envs=2)
envs.reset(seed=1)
image = envs.step([[2, 1, 0, 0]] * 2)[0]["image"]
print(image.tobytes().hex(), "numba" in sys.modules)
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


def test_the_second_process_needs_no_compiler_and_damaged_code_is_replaced(tmp_path: Path) -> None:
    folder = cache_folder()
    assert folder is not None
    python(START)  # so that there is code to copy
    own = tmp_path / "cache" / folder.name
    own.mkdir(parents=True, mode=0o700)
    (tmp_path / "cache").chmod(0o700)
    for name in ("interpreter", "serve"):
        (own / name).write_bytes((folder / name).read_bytes())
    seen, compiled = python(START, SOCIALAI_CACHE_DIR=str(tmp_path / "cache"))
    assert compiled == "False"
    sound = (own / "interpreter").read_bytes()
    (own / "interpreter").write_bytes(sound[:-1])
    assert python(START, SOCIALAI_CACHE_DIR=str(tmp_path / "cache")) == [seen, "True"]
    assert (own / "interpreter").stat().st_size == len(sound), "the damaged code was not replaced"


def test_settings_are_read_without_numba_where_none_is_set() -> None:
    """What we take Numba's settings to be is what they are, so code is found whether Numba is loaded or not."""
    code = "import {}; from socialai_dsl.engine.settings import settings; print(list(settings().values()))"
    assert python(code.format("numba")) == python(code.format("sys"))
    set_so = python(code.format("sys"), NUMBA_OPT="1", NUMBA_DISABLE_JIT="1")
    assert set_so != python(code.format("sys"))
