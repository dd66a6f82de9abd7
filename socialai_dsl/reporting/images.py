"""The figures of a report while it is made, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from matplotlib.figure import Figure as Drawing

from socialai_dsl.reporting.document import Block, Figure, Image
from socialai_dsl.reporting.style import saved


@dataclass
class Images:
    """The figures that were drawn so far, by name."""

    made: dict[str, Image] = field(default_factory=dict)

    def figure(
        self, name: str, draw: Callable[[bool], Drawing | None], alt: str, caption: str
    ) -> Iterator[Block]:
        """The block of a figure, which is kept; nothing if there was nothing to draw.

        Args:
            name: of its files.
            draw: draws it, for a narrow screen if that is asked for.
            alt: what it shows.
            caption: how to read it.
        """
        wide, narrow = draw(False), draw(True)
        if wide is not None and narrow is not None:
            self.made[name] = Image(saved(wide, "svg"), saved(wide, "png"), saved(narrow, "svg"))
            yield Figure(name, alt, caption)
