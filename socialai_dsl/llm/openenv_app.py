"""The application that `openenv.yaml` names: it serves the scenario of the environment variable `SCENARIO`.

`ALLOW` has further names under which it may be asked, with commas between them.
"""

import os

from socialai_dsl.checking.briefing import brief
from socialai_dsl.envs.factory import compiled
from socialai_dsl.frontend import load
from socialai_dsl.llm.openenv import application

loaded = load(os.environ.get("SCENARIO", "talkitout"))
app = application(compiled(loaded), briefing=brief(loaded), hosts=os.environ.get("ALLOW", "").split(","))
