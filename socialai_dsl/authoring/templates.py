"""The scenarios to start from, in the folder `templates`."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Final

from socialai_dsl.errors import UsageError

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
_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")


def write_template(template: str, name: str) -> list[Path]:
    """Write the files of a template into this folder, under the name of a scenario, the scenario itself first.

    Nothing is written if one of them exists. The schema for editors comes beside them; one that is there stays.

    Raises:
        UsageError: a file exists, or that is no name.
        OSError: a file cannot be written.
    """
    if not _WORD.fullmatch(name.removesuffix(".yaml")):
        raise UsageError(f"NAME: expected letters, digits and underscores (at most 40), got {name!r}")
    files = template_files(template, name.removesuffix(".yaml"))
    for path in files:
        if path.exists() or path.is_symlink():
            raise UsageError(f"{path} exists already")
    for path, text in files.items():
        with open(path, "x", encoding="utf-8") as file:
            file.write(text)
    from socialai_dsl.authoring.language_schema import shipped_schema  # it loads the models of all files

    with suppress(FileExistsError), open(SCHEMA, "x", encoding="utf-8") as file:
        file.write(shipped_schema())
    return list(files)


def template_files(template: str, name: str) -> dict[Path, str]:
    """Path -> text, for the files of a template under the name of a scenario; the scenario itself first."""
    modeline = f"# yaml-language-server: $schema={SCHEMA}\n"
    files = _FOLDER.glob(f"{template}*.yaml")
    sources = [path for path in files if re.split(r"[_.]", path.name)[0] == template]
    return {
        Path(name + path.stem.removeprefix(template) + ".yaml"): modeline
        + path.read_text(encoding="utf-8").replace(_STANDING_NAME, name)
        for path in sorted(sources, key=lambda path: len(path.stem))
    }
