"""What an author may write, as pydantic models: shape only, meaning is checked by `semantics`."""

from socialai_dsl.schema.behaviour import CastMember, FirstRule, Frame, Rule, State, Step, ThenRule
from socialai_dsl.schema.scenario import PRIMITIVES, Outcome, Parameter, Scenario
from socialai_dsl.schema.world import ObjectGroup, Observe, Room, UtteranceGrammar

__all__ = [
    "PRIMITIVES",
    "CastMember",
    "FirstRule",
    "Frame",
    "ObjectGroup",
    "Observe",
    "Outcome",
    "Parameter",
    "Room",
    "Rule",
    "Scenario",
    "State",
    "Step",
    "ThenRule",
    "UtteranceGrammar",
]
