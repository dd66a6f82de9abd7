"""The shape of files as pydantic models; `semantics` checks meaning."""
