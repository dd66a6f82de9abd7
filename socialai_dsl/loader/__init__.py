"""From a scenario's name to plain data with positions: reading YAML, `extends` and variants."""

from socialai_dsl.loader.library import shipped_folder
from socialai_dsl.loader.members import Member
from socialai_dsl.loader.offsets import Style
from socialai_dsl.loader.patches import Edit
from socialai_dsl.loader.reader import Data, Document, NodeSpan, PositionedData, read_document
from socialai_dsl.loader.resolved import KINDS, Resolved, resolve, shipped_names

__all__ = [
    "KINDS",
    "Data",
    "Document",
    "Edit",
    "Member",
    "NodeSpan",
    "PositionedData",
    "Resolved",
    "Style",
    "read_document",
    "resolve",
    "shipped_folder",
    "shipped_names",
]
