"""Meaning across models: names, types and flow, each mistake with its place."""
