"""Draw the picture of the README, one room as a person, a language model and an agent each get it: `make picture`.

It shows the room of a test episode of the README's scenario, one step after the agent has spoken. The person's part is
the page of a study in Chromium, so the extras `studio` and `pages` are needed.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone
from socialai_dsl.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from playwright.sync_api import Browser

SUMMARY: Final = "draw one room as a person, a language model and an agent each get it"

_ROOT: Final = Path(__file__).parents[1]
_SCENARIO: Final = "gatekeeper.yaml"
_EPISODE: Final = 105
"""A test episode in which the keeper and the door are in view, and the keeper looks at the agent when it asks."""
_SAID: Final = "Please open the door"
_STUDY: Final = f"""\
study: one_room
consent: I agree.
blocks:
- {{scenario: {_SCENARIO}, episodes: 1, rooms: [{_EPISODE}]}}
end: {{}}
"""
_WIDTHS: Final = {"one_room.png": 1120, "one_room_phone.png": 400}
"""File -> its width in CSS pixels: the three parts side by side, or one below the other on a phone."""
_STYLE: Final = """
body { margin: 0; background: #fff; color: #1b1f24; font: 15px/1.35 "DejaVu Sans", sans-serif; }
main { display: grid; gap: 12px; padding: 12px; }
main.wide { grid-template-columns: 330px 1fr 1fr; }
section { border: 1px solid #c9d1d9; border-radius: 8px; overflow: hidden; }
h2 { margin: 0; padding: 7px 12px; font-size: 16px; background: #eaeef2; }
img { display: block; width: 100%; }
pre { margin: 0; padding: 10px 12px; white-space: pre-wrap; font: 13.5px/1.45 "DejaVu Sans Mono", monospace; }
b { color: #0a58ca; } i { color: #57606a; font-style: normal; }
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument(
        "--out",
        type=Path,
        default=_ROOT / "docs",
        metavar="FOLDER",
        help=f"where {' and '.join(_WIDTHS)} go (default: docs)",
    )


def execute(arguments: argparse.Namespace) -> Exit:
    """Play the step three times, and draw what each gets."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise UsageError("this needs a browser: install the extras `studio` and `pages`") from None
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        raise UsageError("this needs Chromium, on the path or named by CHROMIUM")
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        _save_scenario(Path(folder))
        os.chdir(folder)
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        parts = {
            "A person sees and clicks": f'<img src="{_person(browser, Path(folder))}">',
            "A language model reads and writes": f"<pre>{_model()}</pre>",
            "An RL agent gets and returns arrays": f"<pre>{_agent()}</pre>",
        }
        for file, width in _WIDTHS.items():
            _draw(
                browser,
                parts,
                width,
                (arguments.out if arguments.out.is_absolute() else _ROOT / arguments.out) / file,
            )
        browser.close()
    return Exit.GOOD


def _save_scenario(folder: Path) -> None:
    """The scenario as the README has it."""
    readme = (_ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(rf"^```yaml\n(# {re.escape(_SCENARIO)}\n.*?)^```", readme, re.MULTILINE | re.DOTALL)
    assert found is not None, f"README.md shows {_SCENARIO}"
    (folder / _SCENARIO).write_text(found[1], encoding="utf-8")
    (folder / "study.yaml").write_text(_STUDY, encoding="utf-8")


def _person(browser: "Browser", folder: Path) -> str:
    """The page of a participant, as the address of a picture."""
    import base64

    with _served(folder) as link:
        page = browser.new_page(
            viewport={"width": 420, "height": 900}, device_scale_factor=2, bypass_csp=True
        )
        page.goto(link)
        page.get_by_role("button", name="I agree").click()
        page.get_by_text("Round 1 of 1").wait_for()
        page.locator(".say select").select_option(_SAID)
        page.locator(".say button").click()
        page.get_by_text("After you.").first.wait_for()
        # What is left out is the text for those who do not see, which the middle part has, and the help for keys.
        page.add_style_tag(
            content=".study > header, .seen, main > p.quiet:last-child, .message { display: none !important }"
        )
        shown = page.locator(".study").screenshot(animations="disabled")
        page.close()
    return f"data:image/png;base64,{base64.b64encode(shown).decode()}"


@contextmanager
def _served(folder: Path) -> Iterator[str]:
    """The link of a participant of the study in a folder."""
    command = [
        sys.executable,
        "-m",
        "socialai_dsl",
        "study",
        "run",
        "study.yaml",
        "--port",
        "0",
        "--links",
        "1",
    ]
    server = subprocess.Popen([*command, "--out", "kept"], cwd=folder, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        yield next(line.strip() for line in server.stdout if "/p/" in line)
    finally:
        server.terminate()
        server.wait(20)
        server.stdout.close()


def _model() -> str:
    """What a language model has read, writes and then reads."""
    from socialai_dsl.llm import Episode

    episode = Episode(_SCENARIO)
    before = episode.reset(test_episode=_EPISODE)
    reply = f'Act: say "{_SAID}"'
    after = episode.step(reply).text
    return f"<i>{escape(before)}</i>\n\n<b>{escape(reply)}</b>\n\n{escape(after)}"


def _agent() -> str:
    """What an agent returns and gets."""
    import socialai_dsl

    env = socialai_dsl.make(_SCENARIO)
    env.reset(options={"test_episode": _EPISODE})
    action = env.unwrapped.encode_action((None, _SAID))  # type: ignore[attr-defined]
    observation, reward, terminated, truncated, _ = env.step(action)
    image, tokens = observation["image"], observation["tokens"]
    lines = [f"<b>action = {list(map(int, action))}</b>", ""]
    lines += [
        f"image   uint8 {image.shape}",
        "<i># its channel 0, the types of things,</i>",
        "<i># the agent at the bottom, looking up</i>",
    ]
    lines += [_rows(image[:, :, 0].T), "", f"tokens  int16 {tokens.shape}"]
    lines += [f"{' '.join(map(str, tokens[:6].tolist()))} ...", "", f"reward {reward}"]
    lines += [f"terminated {terminated}", f"truncated {truncated}"]
    return "\n".join(lines)


def _rows(numbers: "np.ndarray") -> str:
    return "\n".join(" ".join(f"{number:2d}" for number in row) for row in numbers)


def _draw(browser: "Browser", parts: dict[str, str], width: int, place: Path) -> None:
    import io

    from PIL import Image

    sections = "".join(f"<section><h2>{title}</h2>{shown}</section>" for title, shown in parts.items())
    kind = "wide" if width == max(_WIDTHS.values()) else ""
    page = browser.new_page(viewport={"width": width, "height": 100}, device_scale_factor=2)
    page.set_content(f'<style>{_STYLE}</style><main class="{kind}">{sections}</main>')
    with Image.open(io.BytesIO(page.screenshot(full_page=True))) as image:
        colors = image.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        colors.save(place, optimize=True)
    page.close()


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m tools.minds_picture", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())
