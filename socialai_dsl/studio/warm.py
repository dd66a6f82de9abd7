"""Importing this module loads all that a window's process needs, and plays a step, which loads compiled code.

The fork server of these processes imports it once, so that none of them waits for it or pays for its memory.
"""

from pathlib import Path

import socialai_dsl.authoring.server  # noqa: F401
from socialai_dsl.studio.session import Session

_SMALLEST = """scenario: ready
horizon: 3
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 5}
cast: {agent: {at: [1, 1]}}
outcome: [{failure: agent.did(done)}, {success: agent.did(toggle)}]
"""

_session = Session()
_session.draw(str(Path("ready.yaml").resolve()), _SMALLEST)
_session.act("left")
