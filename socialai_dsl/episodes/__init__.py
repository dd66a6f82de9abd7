"""Episodes that are played: rooms, a policy on each seat, one loop, and observers that watch.

* `play(rooms, players, agenda)`: the loop; `play_async` for policies that answer later.
* `Policy`: what plays a seat. `RandomPolicy`, `ScriptedPolicy`, `FunctionPolicy`, `PredictingPolicy` (models of
  Stable-Baselines3), `ReplayedPolicy` and `socialai_dsl.trainer.play.CheckpointPolicy` are some.
* `Observer`: what watches rooms. `Results` counts, `Actions` keeps what was done, `Tracing` traces, and so does a film.
* `Stage`: one room, played step by step with steps back, as the terminal and the studio do.
"""

from socialai_dsl.episodes.film import RecordedEpisode, film
from socialai_dsl.episodes.play import (
    AGENT,
    Agenda,
    EachRoom,
    EpisodesInARow,
    Observer,
    OneEpisode,
    Rooms,
    Step,
    play,
    play_async,
)
from socialai_dsl.episodes.players import Player
from socialai_dsl.episodes.policies import (
    EpisodeOver,
    FunctionPolicy,
    Leaving,
    Observation,
    Policy,
    PolicyDone,
    PredictingPolicy,
    RandomPolicy,
    ReplayedPolicy,
    ScriptedPolicy,
    Streams,
)
from socialai_dsl.episodes.results import Actions, EvalResult, Results, wilson_interval
from socialai_dsl.episodes.room_sets import RoomSet
from socialai_dsl.episodes.stage import Stage
from socialai_dsl.episodes.traces import Tracing, trace_of
from socialai_dsl.model_options import ModelOptions

__all__ = [
    "AGENT",
    "Actions",
    "Agenda",
    "EachRoom",
    "EpisodeOver",
    "EpisodesInARow",
    "EvalResult",
    "FunctionPolicy",
    "Leaving",
    "ModelOptions",
    "Observation",
    "Observer",
    "OneEpisode",
    "Player",
    "Policy",
    "PolicyDone",
    "PredictingPolicy",
    "RandomPolicy",
    "RecordedEpisode",
    "ReplayedPolicy",
    "Results",
    "RoomSet",
    "Rooms",
    "ScriptedPolicy",
    "Stage",
    "Step",
    "Streams",
    "Tracing",
    "film",
    "play",
    "play_async",
    "trace_of",
    "wilson_interval",
]
