"""The replay page: episodes as one HTML file that loads nothing from elsewhere."""

from __future__ import annotations

import base64
import gzip
import hashlib
from collections.abc import Sequence
from html import escape
from typing import Final, Protocol

from socialai_dsl.traces.scripts import bundled, static_text

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src {scripts}; style-src {styles}">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript>This page shows episodes by a script that lies in it; allow scripts to see them.</noscript>
<script id="episodes" type="application/octet-stream">{episodes}</script>
<script type="module">{script}</script>
</body>
</html>
"""


class Shown(Protocol):
    """The interface of an episode for the page."""

    @property
    def scenario(self) -> str:
        """As it was asked for."""

    @property
    def succeeded(self) -> bool:
        """Whether it ended in success."""

    def as_json(self) -> str:
        """The episode as one line of JSON."""


def replay_page(traces: Sequence[Shown]) -> str:
    """One HTML file with the episodes, which loads nothing from elsewhere; successes come first.

    Raises:
        ValueError: there is no episode.
    """
    if not traces:
        raise ValueError("traces: got none, expected at least one")
    ordered = sorted(traces, key=lambda trace: not trace.succeeded)
    data = "[" + ",".join(trace.as_json() for trace in ordered) + "]"
    packed = base64.b64encode(gzip.compress(data.encode(), mtime=0)).decode()
    script, style = bundled("replay.js"), static_text("pages.css")
    return _PAGE.format(
        scripts=_hash(script),
        styles=_hash(style),
        title=escape(f"{ordered[0].scenario}: {len(ordered)} episodes"),
        style=style,
        episodes=packed,
        script=script,
    )


def _hash(text: str) -> str:
    """What a content security policy calls an inline script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
