"""What an author may write, as pydantic models: shape only, meaning is checked by `semantics`."""

from socialai_dsl.schema.behaviour import (
    Belief,
    CastMember,
    FirstRule,
    Frame,
    Npc,
    Ranged,
    Role,
    Rule,
    State,
    Step,
    ThenRule,
    WorldRule,
)
from socialai_dsl.schema.properties import OnlyThrough, Probe, Property
from socialai_dsl.schema.scenario import Memory, Outcome, Parameter, Reward, Scenario, Sequence
from socialai_dsl.schema.world import ObjectGroup, Observe, Room, UtteranceGrammar

__all__ = [
    "Belief",
    "CastMember",
    "FirstRule",
    "Frame",
    "Memory",
    "Npc",
    "ObjectGroup",
    "Observe",
    "OnlyThrough",
    "Outcome",
    "Parameter",
    "Probe",
    "Property",
    "Ranged",
    "Reward",
    "Role",
    "Room",
    "Rule",
    "Scenario",
    "Sequence",
    "State",
    "Step",
    "ThenRule",
    "UtteranceGrammar",
    "WorldRule",
]
