"""The figures of a report while it is made, each under its name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from matplotlib.figure import Figure as Drawing

from socialai_dsl.reporting.document import Block, Figure
from socialai_dsl.reporting.style import saved


@dataclass
class Images:
    """The figures that were drawn so far, by name."""

    made: dict[str, tuple[bytes, bytes]] = field(default_factory=dict)

    def figure(self, name: str, drawn: Drawing | None, alt: str, caption: str) -> Iterator[Block]:
        """The block of a figure, which is kept; nothing if there was nothing to draw."""
        if drawn is not None:
            self.made[name] = (saved(drawn, "svg"), saved(drawn, "png"))
            yield Figure(name, alt, caption)
