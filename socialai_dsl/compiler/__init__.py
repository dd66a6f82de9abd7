"""Checked scenario to program: the passes, which `socialai_dsl.compilation` runs one after the other."""
