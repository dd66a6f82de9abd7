"""Analyses of scenarios by play: searches, claims, guesses, coverage."""
