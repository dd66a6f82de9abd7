"""Sphinx: the pages of this folder as a site, with `make docs`."""

project = "socialai-dsl"
author = "socialai-dsl contributors"
copyright = author

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
myst_heading_anchors = 4
myst_enable_extensions = ["attrs_inline"]
myst_html_meta = {
    "description": "Write a social experiment as one page of YAML; people, language models and RL agents play it "
    "in the same rooms."
}
# Pages link to files of the project, which are no pages of the site: they are offered for download.
suppress_warnings = ["myst.header"]

# Docstrings write code in single backquotes.
default_role = "code"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = True
napoleon_use_ivar = True

# Of a console only what is typed is copied.
copybutton_prompt_text = "$ "
copybutton_line_continuation_character = "\\"

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/favicon.svg"
html_title = "socialai-dsl"
exclude_patterns = ["_build", "results"]
nitpicky = True
# Types of other libraries, and of our own that no page shows.
nitpick_ignore_regex = [("py:.*", ".*")]


def setup(app):
    """Let the keyboard scroll what is wider than the screen, and tell screen readers how deep a heading is."""

    def reachable(app, page, template, context, document):
        for part in ("body", "furo_navigation_tree"):
            html = context.get(part, "").replace("<pre>", '<pre tabindex="0">')
            context[part] = html.replace('role="heading">', 'role="heading" aria-level="2">')

    app.connect("html-page-context", reachable, priority=900)  # Furo makes its menu before
