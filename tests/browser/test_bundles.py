"""The studio's editor is bundled from what is locked, and its bundle comes with the licences of all that is in it."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(shutil.which("node") is None, reason="nothing is bundled without Node")
def test_editor_and_notices_are_what_is_bundled(tmp_path: Path) -> None:
    subprocess.run(["node", "editor/build.mjs", str(tmp_path)], cwd=ROOT, check=True, timeout=120)
    editor = ROOT / "socialai_dsl" / "studio" / "static" / "editor.js"
    assert (tmp_path / "editor.js").read_bytes() == editor.read_bytes(), "npm run bundle"
    notices = ROOT / "THIRD_PARTY_NOTICES"
    assert (tmp_path / "THIRD_PARTY_NOTICES").read_bytes() == notices.read_bytes(), "npm run bundle"
