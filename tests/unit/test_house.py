"""The rules of the house, as far as a program can check them."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig import errors

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(
    path for package in ("rig", "drivers", "sim") for path in (ROOT / package).rglob("*.py")
)
UNITS = re.compile(r"(^|_)(mm|px|px2|s|rad|deg|hz|pct|mb|degc|levels|ppm|mm_s|mm_s2|steps?|in)$")
RATIOS = {
    "share",
    "ratio",
    "scale",
    "gain",
    "percent",
    "weight",
    "value",
    "sigma",
    "ridge",
    "damping",
}
"""Numbers without a dimension, or in the unit of the array beside them."""
GREYS = {
    "grey_step",
    "derivative_variance",
    "grey_scale",
    "grey_gate",
    "truncation",
    "level",
    "picture",
    "grain",
    "fall",
}
"""Grey levels and shares of grey."""
LIMITS = {"warn_above", "fail_above"}
"""In the unit of the value beside them."""
FORBIDDEN_NAMES = {"utils", "helpers", "common", "manager", "base", "misc"}


def error_classes() -> list[type[errors.RigError]]:
    found: list[type[errors.RigError]] = []
    todo: list[type[errors.RigError]] = [errors.RigError]
    while todo:
        found.append(todo.pop())
        todo.extend(found[-1].__subclasses__())
    return found


@pytest.mark.parametrize("error", error_classes(), ids=lambda error: error.__name__)
def test_every_error_is_in_the_drawn_tree_and_raised_by_a_test(error: type[errors.RigError]):
    assert error.__module__ == "rig.errors"
    assert error.__name__ in (errors.__doc__ or "")
    if error in (errors.RigError, errors.DeviceError):
        return  # families: their members are raised
    raised = re.compile(rf"raises\(\s*\(?[^)]*\b{error.__name__}\b")
    assert any(raised.search(path.read_text()) for path in (ROOT / "tests").rglob("*.py"))


def float_parameters(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            for argument in [*node.args.args, *node.args.kwonlyargs]:
                kind = argument.annotation
                if isinstance(kind, ast.Name) and kind.id == "float":
                    yield argument.arg


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_dimensioned_parameter_carries_its_unit(path: Path):
    bare = {name for name in float_parameters(path) if not UNITS.search(name)}
    assert bare - RATIOS - GREYS - LIMITS == set()


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_has_a_name_that_says_nothing(path: Path):
    assert not FORBIDDEN_NAMES & set(path.stem.split("_"))
