"""Help for those who write scenarios: the language as a JSON Schema, a formatter, a language server."""
