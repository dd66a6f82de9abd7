"""What an index of packages shows of the project: the README, whose links and pictures lead to the repository."""

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r'(?<=\]\()(?!\w+:)[^)\s]+|(?<=src=")(?!\w+:)[^"]+|(?<=srcset=")(?!\w+:)[^"]+')
PICTURES = (".gif", ".png", ".svg")


def absolute(text: str, source: str) -> str:
    """The text with links that begin with the address of the repository, pictures with that of their bytes."""

    def target(found: re.Match[str]) -> str:
        path = found.group()
        if path.startswith("#"):
            return source + path
        return f"{source}/{'raw' if path.endswith(PICTURES) else 'blob'}/main/{path}"

    return LINK.sub(target, text)


class Readme(MetadataHookInterface):
    """Makes the description of the package when it is built."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the README to the metadata; the addresses in `[project.urls]` are the only ones."""
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": absolute(text, metadata["urls"]["Source"]),
        }
