"""Importing this module loads all that a window's process needs, and plays a step, which loads compiled code.

The fork server of these processes imports it once, so that none of them waits for it or pays for its memory.
"""

from pathlib import Path

from socialai_dsl.authoring.templates import TEMPLATES, template_files
from socialai_dsl.studio.session import Session
from socialai_dsl.studio.worker import Desk  # noqa: F401

# A template, since it has what real scenarios have: NPCs with frames, rules that hear, things and an outcome.
_name, _text = next(iter(template_files(next(iter(TEMPLATES)), "ready").items()))
_session = Session()
_session.draw(str(Path(_name).resolve()), _text)
_session.prepare()
_session.act("left")
