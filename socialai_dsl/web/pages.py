"""The skeleton of our pages, the headers that guard them, and the check that a request is for us and from us."""

from __future__ import annotations

import secrets
from collections.abc import Collection
from html import escape
from pathlib import Path
from typing import Final, TypeVar
from urllib.parse import urlsplit

from starlette.responses import HTMLResponse, PlainTextResponse, Response

from socialai_dsl.traces.scripts import static_text

Answer = TypeVar("Answer", bound=Response)

_LOOPBACK: Final = ("127.0.0.1", "::1")
_PORTS: Final = {"http": 80, "https": 443}
_SHARED: Final = ("dom.js", "panels.js", "room.js", "seat.js", "tiles.js", "trace.js", "pages.css")
_PAGE: Final = """<!doctype html>
<html lang="{language}">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="style-nonce" content="{nonce}">
<title>{title}</title>
<link rel="stylesheet" href="/static/pages.css">
<link rel="stylesheet" href="/static/{style}">
<link rel="icon" href="data:,">
</head>
<body{data}>
<noscript>{without}</noscript>
<script type="module" src="/static/{script}"></script>{older}
</body>
</html>
"""


def page(
    script: str, style: str, title: str, without: str, language: str = "en", older: str = "", **data: str
) -> HTMLResponse:
    """A page that one of our scripts fills.

    Args:
        script: the name of a static file.
        style: likewise.
        title: of the page.
        without: what is said where scripts are off.
        language: of the page, as a tag.
        older: the name of a script for browsers of any age, which says what the page needs, if there is one.
        **data: what the script finds in `document.body.dataset`.
    """
    nonce = secrets.token_urlsafe(16)
    words = "".join(f' data-{name}="{escape(value)}"' for name, value in data.items())
    filled = _PAGE.format(
        nonce=nonce,
        script=script,
        style=style,
        title=escape(title),
        without=escape(without),
        language=escape(language),
        data=words,
        older=f'\n<script src="/static/{older}"></script>' if older else "",
    )
    return guarded(HTMLResponse(filled), nonce)


def static_file(name: str, own: Collection[str], folder: Path) -> Response:
    """A script or a style: one that all pages share, or one of the server's own."""
    if name in _SHARED:
        text = static_text(name)
    elif name in own:
        text = (folder / name).read_text(encoding="utf-8")
    else:
        return PlainTextResponse("there is no such file", 404)
    kind = "text/css" if name.endswith(".css") else "text/javascript"
    return guarded(Response(text, media_type=kind))


def guarded(response: Answer, nonce: str = "") -> Answer:
    """The response with headers by which its page loads from us alone, is in no frame and is stored nowhere."""
    response.headers.update(
        {
            "Content-Security-Policy": "default-src 'none'; script-src 'self'; connect-src 'self'; "
            f"img-src 'self' data:; style-src 'self' 'nonce-{nonce}'; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Cache-Control": "no-store",
        }
    )
    return response


class Address:
    """The addresses under which a server may be asked.

    Args:
        host: that is listened at.
        public: what a proxy is asked for, such as `https://study.example.org`; then nothing else is answered.
        admitted: origins of other pages that may open a connection where `admits` is asked.
    """

    def __init__(self, host: str, public: str | None = None, admitted: Collection[str] = ()) -> None:
        self._host, self._public = host, None if public is None else public.rstrip("/")
        self._admitted = frozenset(admitted)

    def is_own(self, host: str | None) -> bool:
        """Whether a page was asked for under our own address, not under a name that leads here."""
        if self._public is not None:
            return host == urlsplit(self._public).netloc
        if self._host not in _LOOPBACK:
            return True
        try:
            return urlsplit(f"//{host}").hostname in (*_LOOPBACK, "localhost")
        except ValueError:
            return False

    def comes_from_us(self, host: str | None, origin: str | None) -> bool:
        """Whether a connection is opened by one of our own pages."""
        return self.is_own(host) and origin == (self._public or f"http://{host}")

    def admits(self, origin: str | None) -> bool:
        """Whether a connection is opened by a page of another origin that is admitted."""
        return origin in self._admitted


def origin_of(address: str) -> str | None:
    """The origin of a page as browsers send it, such as `https://lab.example.org`; None if the address is not one."""
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        return None
    whole = parts.path in ("", "/") and not (parts.query or parts.fragment or "@" in parts.netloc)
    if parts.scheme not in _PORTS or not parts.hostname or not whole:
        return None
    name = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    return f"{parts.scheme}://{name}" + (f":{port}" if port not in (None, _PORTS[parts.scheme]) else "")
