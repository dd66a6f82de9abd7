"""This package holds what `socialai bench` compares with; it stays in the repository, no wheel carries it."""
