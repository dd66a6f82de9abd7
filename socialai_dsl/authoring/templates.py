"""The scenarios to start from, in the folder `templates`."""

from pathlib import Path
from typing import Final

TEMPLATES: Final = {
    "ask-a-guide": "ask an NPC which of four doors is the right one (the default)",
    "imitate": "watch what a peer does, then do the same",
    "hidden-information": "only the caretaker knows which box, and points at it",
    "role-swap": "two who need each other; the agent can have either part",
    "empty": "a room, a door and an agent",
}
"""Name -> one line; the files are in the folder `templates`."""

SCHEMA: Final = "socialai.schema.json"
"""The file beside a new scenario that tells editors what may be written."""

_FOLDER: Final = Path(__file__).with_name("templates")
_STANDING_NAME: Final = "my_scenario"


def template_files(template: str, name: str) -> dict[Path, str]:
    """Path -> text, for the files of a template under the name of a scenario; the scenario itself first."""
    modeline = f"# yaml-language-server: $schema={SCHEMA}\n"
    sources = [path for path in _FOLDER.glob(f"{template}*.yaml") if path.stem.partition("_")[0] == template]
    return {
        Path(name + path.stem.removeprefix(template) + ".yaml"): modeline
        + path.read_text(encoding="utf-8").replace(_STANDING_NAME, name)
        for path in sorted(sources, key=lambda path: len(path.stem))
    }
