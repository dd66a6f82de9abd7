"""The room as pictures and as text, from the cells of an observation."""
