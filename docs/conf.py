"""How Sphinx builds the site: `make docs`. Nothing here reaches for the network."""

import rig

project = "rig"
author = "the rig developers"
version = release = rig.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["examples"]

# Pages are Markdown; every heading can be linked to.
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 4

# Docstrings are Google's; single backticks are code in them, as everywhere in this repository.
default_role = "code"
napoleon_numpy_docstring = False
autodoc_member_order = "bysource"
autodoc_class_signature = "separated"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"rig {release}"
html_static_path = ["_static"]
html_css_files = ["rig.css"]
html_copy_source = False
html_show_sphinx = False

# Every name of rig's own that a page or a docstring refers to must be documented; other people's
# inventories would have to be fetched.
nitpicky = True
nitpick_ignore_regex = [(r"py:.*", r"(?!rig\.).*")]
