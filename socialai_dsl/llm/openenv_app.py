"""The application that `openenv.yaml` names: it serves the scenario of the environment variable `SCENARIO`.

`ALLOW` has further names under which it may be asked, with commas between them.
"""

import os

from socialai_dsl.envs.factory import playable_of
from socialai_dsl.llm.openenv import application

app = application(
    playable_of(os.environ.get("SCENARIO", "talkitout")), hosts=os.environ.get("ALLOW", "").split(",")
)
