"""Sphinx: the pages of this folder as a site, with `make docs`."""

project = "socialai-dsl"
author = "socialai-dsl contributors"
copyright = author

extensions = ["myst_parser"]
myst_heading_anchors = 4
myst_enable_extensions = ["attrs_inline"]
# Pages link to files of the project, which are no pages of the site: they are offered for download.
suppress_warnings = ["myst.header"]

html_theme = "furo"
html_title = "socialai-dsl"
exclude_patterns = ["_build", "results"]
nitpicky = True
