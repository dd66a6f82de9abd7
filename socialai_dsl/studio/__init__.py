"""The studio: scenarios are written, seen and played in a browser. `server` is what it talks to."""
