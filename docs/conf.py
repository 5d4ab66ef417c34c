"""The documentation site: `make docs` builds it into out/site."""

import sys
from importlib.metadata import files
from pathlib import Path

import gpi_hammerstein as gpi

sys.path.insert(0, str(Path(__file__).parent))

project = "gpi-hammerstein"
author = "The gpi-hammerstein developers"
project_copyright = author
release = version = gpi.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "gallery",
    "streams",
]
exclude_patterns = ["**/.ipynb_checkpoints"]

html_theme = "furo"
html_title = f"gpi-hammerstein {release}"
# Formulas are typeset without a network. This file of MathJax needs no other file, so that it also
# works if pages are opened from a disk.
(MATHJAX,) = (file for file in files("sphinx-mathjax-offline") or [] if file.name == "tex-svg.js")
html_static_path = ["style", str(MATHJAX.locate())]
html_css_files = ["site.css"]
mathjax_path = MATHJAX.name
# The menu would load files that are not there.
mathjax3_config = {"options": {"enableMenu": False}}
# Copies contain no prompts.
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
# Every page runs completely, also a notebook that contains outputs; an error stops the build.
nb_execution_mode = "force"
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
