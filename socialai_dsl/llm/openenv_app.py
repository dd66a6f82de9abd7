"""The application that `openenv.yaml` names: it serves the scenario of the environment variable `SCENARIO`.

`ALLOW` has further names under which it may be asked, with commas between them; `SEATS`, likewise, who plays which of
several seats: `jill=script`.
"""

import os

from socialai_dsl.checking.briefing import brief
from socialai_dsl.episodes.partners import beside
from socialai_dsl.llm.openenv import application

seats = [pair.partition("=")[::2] for pair in filter(None, os.environ.get("SEATS", "").split(","))]
played = beside(seats, os.environ.get("SCENARIO", "talkitout"))
app = application(played, briefing=brief(played.loaded), hosts=os.environ.get("ALLOW", "").split(","))
