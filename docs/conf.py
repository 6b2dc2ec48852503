"""How Sphinx builds the site: `make docs`. Nothing here reaches for the network."""

import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import GoogleDocstring

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
maximum_signature_line_length = 80
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"rig {release}"
html_static_path = ["_static"]
html_css_files = ["rig.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False

# Every name of rig's own that a page or a docstring refers to must be documented; other people's
# inventories would have to be fetched.
nitpicky = True
nitpick_ignore_regex = [(r"py:.*", r"(?!rig\.).*"), (r"py:.*", r"rig\..*\._.*")]

_sentences: dict[str, list[str]] = {}
"""Docstrings of attributes by name, between the two steps below."""
_ARRAY = re.compile(
    r"[~\w.]*ndarray\[[~\w.]*tuple\[[~\w.]*Any, \.\.\.\], [~\w.]*dtype\[[~\w.]*?(\w+)\]\]"
)


_STORED = re.compile(r"[~\w.]*Annotated\[(.*?), stored as [a-z ]+\]")
"""Types of fields that say how they are stored (`rig.arrays`)."""


def _as_written(text: str) -> str:
    """Return a type as the code writes it; numpy spells its alias out."""
    return _ARRAY.sub(r"NDArray[\1]", _STORED.sub(r"\1", text))


def _keep(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Read an attribute's docstring as a sentence: napoleon takes `word: text` for a type."""
    if what in ("attribute", "data", "property"):
        parsed = GoogleDocstring(lines, app.config, app, "method", name, value, options)
        _sentences[name] = parsed.lines()


def _restore(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Put the sentence back when napoleon is done; show drawn trees as they are drawn."""
    lines[:] = _sentences.pop(name, lines)
    drawn = [at for at, line in enumerate(lines) if "──" in line]
    if drawn:
        first, last = drawn[0] - 1, drawn[-1]
        tree = [f"    {line}" for line in lines[first : last + 1]]
        lines[first : last + 1] = ["::", "", *tree, ""]


def _shorten_signature(
    app: Sphinx, what: str, name: str, value: Any, options: Any, signature: str, returns: str
) -> tuple[str, str] | None:
    """Protocols and enumerations are not called."""
    is_called = signature not in ("(*args, **kwargs)", "(value)")
    return None if what != "class" or is_called else ("", returns)


def _shorten_arrays(app: Sphinx, domain: str, kind: str, content: Any) -> None:
    """Write types of arguments that are arrays as the code does."""
    for types in app.env.current_document.autodoc_annotations.values():
        for name, text in types.items():
            types[name] = _as_written(text)


def _shorten_fields(app: Sphinx, page: nodes.document, name: str) -> None:
    """The same for attributes, once their names are resolved."""
    for node in page.findall(addnodes.desc_annotation):
        text = node.astext()
        if _as_written(text) != text and not any(node.findall(nodes.reference)):
            node[:] = [nodes.Text(_as_written(text))]


def setup(app: Sphinx) -> None:
    """Register what stands above; called by Sphinx."""
    app.connect("autodoc-process-docstring", _keep, priority=400)
    app.connect("autodoc-process-docstring", _restore, priority=600)
    app.connect("autodoc-process-signature", _shorten_signature)
    app.connect("object-description-transform", _shorten_arrays, priority=100)
    app.connect("doctree-resolved", _shorten_fields)
