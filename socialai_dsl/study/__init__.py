"""Studies with people: a server of its own, a log that nothing is lost of, and the data that it makes."""

FIRST_PORT = 8870
FOLDER = "studies"
