"""Experiments: many runs declared in one file, each a process of `socialai run`, and folders that hold the truth."""
