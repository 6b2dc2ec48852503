"""Templates of pages: what they show is text, what they miss is an error."""

from pathlib import Path

import pytest
from jinja2 import UndefinedError

from rig.report.page import render_template


def page(path: Path, text: str, **values: object) -> str:
    template = path / "it.html"
    template.write_text(text)
    return render_template(template, **values)


def test_values_are_text_and_no_markup(tmp_path: Path):
    assert page(tmp_path, "{{ it }}", it="<b> & co") == "&lt;b&gt; &amp; co"


def test_a_missing_value_is_an_error(tmp_path: Path):
    with pytest.raises(UndefinedError, match="it"):
        page(tmp_path, "{{ it }}")


def test_lines_of_statements_leave_no_trace(tmp_path: Path):
    text = "a\n  {% if it %}\nb\n  {% endif %}\nc"
    assert page(tmp_path, text, it=True) == "a\nb\nc"
