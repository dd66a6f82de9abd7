"""What can go wrong while environments run: only what an author asks for and chance cannot give."""


class RoomError(RuntimeError):
    """No room that was drawn for an episode is as the scenario's `require` asks."""
