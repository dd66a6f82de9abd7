"""The commands `socialai` and `socialai-run`; each command imports what it needs when it runs."""
