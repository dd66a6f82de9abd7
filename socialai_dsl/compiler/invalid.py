"""The verifier's refusal."""


class InvalidProgramError(AssertionError):
    """A program that is not proven safe. Its author is the compiler, so it is our mistake and not an author's."""

    def __init__(self, message: str) -> None:
        super().__init__(f"internal: the program is refused: {message}")
