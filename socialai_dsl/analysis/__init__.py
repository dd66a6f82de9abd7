"""What can happen in a scenario, tried on its rooms: searches, claims, guesses, coverage."""
