"""Replays: the trace of a played episode, and the page that shows it."""

from socialai_dsl.traces.document import FORMAT, Thought, Trace, trace_schema
from socialai_dsl.traces.tracing import Tracer

__all__ = ["FORMAT", "Thought", "Trace", "Tracer", "trace_schema"]
