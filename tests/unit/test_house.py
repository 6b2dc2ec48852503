"""The rules of the house, as far as a program can check them."""

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cache
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
    "most_share",
    "ratio",
    "scale",
    "gain",
    "percent",
    "weight",
    "value",
    "sigma",
    "ridge",
    "damping",
    "chance",
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
LENSES = {"tan_x", "tan_y", "radial", "below", "inverse"}
"""Tangents of directions, and what a lens multiplies and divides them by."""
LIMITS = {"warn_above", "fail_above"}
"""In the unit of the value beside them."""
FORBIDDEN_NAMES = {"utils", "helpers", "common", "manager", "base", "misc"}


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of a module, parsed once for all rules."""
    return tuple(ast.walk(ast.parse(path.read_text())))


@cache
def words_of_tests() -> str:
    return "\n".join(path.read_text() for path in (ROOT / "tests").rglob("*.py"))


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
    assert raised.search(words_of_tests())


NO_ADVICE = {
    "rig/curve/least_squares.py": "why one law was rejected; the fit takes another and advises",
    "rig/curve/models.py": "why one law was rejected; the fit takes another and advises",
    "rig/profile/load.py": "each problem of the profile names the key that is near",
    "rig/sweep/resume.py:_slopes_px": "a stored failure is one text that holds the advice",
}
"""Where an error is made without advice, and why."""


@cache
def needs_advice(name: str) -> bool:
    """Whether it is an error of ours that says what to do only if it is told."""
    kind = getattr(errors, name, None)
    if not (isinstance(kind, type) and issubclass(kind, errors.RigError)):
        return False
    advice = inspect.signature(kind).parameters.get("advice")
    return advice is not None and advice.default == ""


def without_advice(path: Path) -> Iterator[str]:
    """Yield the functions that make an error which does not say what to do."""
    where = path.relative_to(ROOT).as_posix()
    for function in (n for n in nodes(path) if isinstance(n, ast.FunctionDef)):
        for call in (n for n in ast.walk(function) if isinstance(n, ast.Call)):
            if isinstance(call.func, ast.Name) and needs_advice(call.func.id):
                advice = [word.value for word in call.keywords if word.arg == "advice"]
                if not advice or ast.unparse(advice[0]) == "''":
                    yield f"{where}:{function.name}"


def test_every_error_says_what_to_do():
    found = {
        where
        for path in SOURCES
        if path != ROOT / "rig/errors.py"
        for where in without_advice(path)
    }
    assert {where for where in found if not where.startswith(tuple(NO_ADVICE))} == set()
    idle = [entry for entry in NO_ADVICE if not any(where.startswith(entry) for where in found)]
    assert idle == []


CUTS = {"partition", "rpartition", "split", "rsplit", "removeprefix", "removesuffix", "find"}


def cuts_of_texts(path: Path) -> Iterator[int]:
    """Yield lines that cut the text of a value, or any text at the mark before the advice."""
    for node in nodes(path):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
            continue
        if node.func.attr not in CUTS or not node.args:
            continue
        first, text = node.args[0], node.func.value
        mark = first.value if isinstance(first, ast.Constant) else None
        is_str = isinstance(text, ast.Call) and ast.unparse(text.func) == "str"
        if mark == "; " or (is_str and mark != "\n"):
            yield node.lineno


def test_no_code_cuts_the_text_of_an_error():
    help_of_verbs = ROOT / "rig/cli/verbs.py"  # cuts what it prints of docstrings
    paths = [path for path in SOURCES if path != help_of_verbs]
    assert [f"{path.name}:{line}" for path in paths for line in cuts_of_texts(path)] == []


def float_parameters(path: Path) -> Iterator[str]:
    for node in nodes(path):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            for argument in [*node.args.args, *node.args.kwonlyargs]:
                kind = argument.annotation
                if isinstance(kind, ast.Name) and kind.id == "float":
                    yield argument.arg


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_dimensioned_parameter_carries_its_unit(path: Path):
    bare = {name for name in float_parameters(path) if not UNITS.search(name)}
    assert bare - RATIOS - GREYS - LENSES - LIMITS == set()


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_has_a_name_that_says_nothing(path: Path):
    assert not FORBIDDEN_NAMES & set(path.stem.split("_"))
