"""Checks resolved files, one module for each kind: from data to meaning, or to findings."""
