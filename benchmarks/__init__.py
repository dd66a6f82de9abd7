"""This package holds what `make bench` compares with; it stays in the repository, no wheel carries it."""
