"""Resolved files to what they mean, or to what is wrong with them: one module for each kind of file."""
