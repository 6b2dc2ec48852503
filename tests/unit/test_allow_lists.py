"""The contract of imports notices what no line allows, a package without a line, and idle names."""

import grimp
import pytest

from tests.support.allow_lists import broken_lines

LINES = {"rig.curve": {"numpy"}, "rig.cli": {"rig.curve", "rig_sim"}, "rig_sim": {"rig.curve"}}


def graph(*imports: tuple[str, str]) -> grimp.ImportGraph:
    """Imports that keep `LINES`, and some more."""
    made = grimp.ImportGraph()
    kept = (
        ("rig.curve.fit", "numpy"),
        ("rig.curve.fit", "rig.curve.points"),
        ("rig.cli.sweep", "rig.curve.fit"),
        ("rig.cli.sweep", "rig_sim.wire.serve"),
        ("rig.cli.sweep", "json"),
        ("rig_sim.world", "rig.curve"),
        ("rig_sim.world", "rig_sim.optics"),
    )
    for importer, imported in (*kept, *imports):
        made.add_import(importer=importer, imported=imported)
    return made


def test_what_the_lines_allow_is_kept():
    assert broken_lines(graph(), LINES) == []


@pytest.mark.parametrize(
    ("importer", "imported", "told"),
    [
        ("rig.curve.fit", "rig.cli.sweep", "rig.curve may not import rig.cli"),
        ("rig.curve.fit", "scipy", "rig.curve may not import scipy"),
        ("rig_sim.world", "rig.cli", "rig_sim may not import rig.cli"),
        ("rig.fresh", "rig.curve", "rig.fresh may not import rig.curve"),
        ("rig.cli", "rig", "rig.cli may not import rig: rig.cli -> rig"),
    ],
)
def test_what_no_line_allows_is_named(importer: str, imported: str, told: str):
    (line,) = broken_lines(graph((importer, imported)), LINES)
    assert line.startswith(told)
    assert f"{importer} -> {imported}" in line


def test_a_line_that_allows_too_much_is_named():
    (line,) = broken_lines(graph(), LINES | {"rig.curve": {"numpy", "scipy"}})
    assert line == "rig.curve does not import scipy: take it out of its line"
