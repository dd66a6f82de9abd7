"""Runs: the folder of each, what its options stand for, and what is done with it."""
