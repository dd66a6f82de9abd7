"""A report as one HTML page: no script, nothing from elsewhere, everything from files escaped."""

from __future__ import annotations

import base64
from importlib.resources import files
from typing import Final

import jinja2
from markupsafe import Markup

from socialai_dsl.reporting.document import Document

_PLACE: Final = "socialai_dsl.reporting"


def render_page(document: Document) -> str:
    """The page. Figures are SVG images in it, in which a browser runs and loads nothing."""
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    environment.filters["kind"] = lambda block: type(block).__name__
    environment.filters["slug"] = slug
    template = environment.from_string(_text("page.html.jinja"))
    images = {name: (_address(one.svg), _address(one.narrow)) for name, one in document.images.items()}
    # The style sheet is ours.
    return template.render(document=document, images=images, style=Markup(_text("page.css"))) + "\n"


def slug(text: str) -> str:
    """A name for links: letters, digits and hyphens."""
    return "".join(letter if letter.isascii() and letter.isalnum() else "-" for letter in text)


def _text(name: str) -> str:
    return files(_PLACE).joinpath(name).read_text(encoding="utf-8")


def _address(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
