"""A report's page as a test reads it."""

from html.parser import HTMLParser


class Page(HTMLParser):
    """Tags with their attributes, the text, and the tables: rows of cells, of each its first line."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.tables: list[list[list[str]]] = []
        self._cell: list[str] | None = None
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self._cell = []

    def handle_data(self, data: str) -> None:
        self.text += " ".join(data.split()) + " "
        if self._cell is not None and data.strip():
            self._cell.append(" ".join(data.split()))

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th") and self._cell is not None:
            self.tables[-1][-1].append(self._cell[0] if self._cell else "")
            self._cell = None

    def table(self, heading: str) -> list[list[str]]:
        """The rows below the head of the first table that has this heading; none if no table has it."""
        return next((table[1:] for table in self.tables if heading in table[0]), [])
