"""What an author may write, as pydantic models: shape only, meaning is checked by `semantics`."""
