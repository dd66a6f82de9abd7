"""From a scenario's name to plain data with positions: reading YAML, `extends` and variants."""

from socialai_dsl.loader.document import Data, DataPath, Document, NodeSpan, Positions, Style
from socialai_dsl.loader.reader import read_document

__all__ = ["Data", "DataPath", "Document", "NodeSpan", "Positions", "Style", "read_document"]
