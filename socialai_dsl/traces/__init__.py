"""Traces of played episodes, and the page that replays them."""

from socialai_dsl.traces.document import FORMAT, Thought, Trace, trace_schema
from socialai_dsl.traces.tracing import Tracer

__all__ = ["FORMAT", "Thought", "Trace", "Tracer", "trace_schema"]
