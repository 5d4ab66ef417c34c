"""The documentation site: `make docs` builds it into out/site."""

import gpi_hammerstein as gpi

project = "gpi-hammerstein"
author = "The gpi-hammerstein developers"
project_copyright = author
release = version = gpi.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
exclude_patterns = ["**/.ipynb_checkpoints"]

html_theme = "furo"
html_title = f"gpi-hammerstein {release}"
html_static_path = ["style"]
html_css_files = ["site.css"]

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
# Every page runs completely; an error stops the build.
nb_execution_mode = "auto"
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_ivar = True
# Shapes such as `(samples, inputs)` are used in place of types and are not references.
napoleon_use_param = False
napoleon_use_rtype = False
# Docstrings quote code with single backticks.
default_role = "literal"
# The language of pages that are not run is unknown.
suppress_warnings = ["myst-nb.lexer"]
