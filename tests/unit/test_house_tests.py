"""The rules of the tests themselves: each asserts something, and what its name promises."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILES = [*sorted((ROOT / "tests").rglob("*.py")), *sorted((ROOT / "rig/testing").rglob("*.py"))]
TREES = {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text()) for path in FILES}
JUDGES = {"raises", "warns", "fail"}
"""Calls that fail a test by themselves, beside those whose name begins with `assert_`."""
WORDS = re.compile(r"_(says?|names?|named|tells?|told)(_|$)")
"""A test whose name has one of these looks at the words of an error, not only at its kind."""

SILENT = {
    "test_a_current_database_opens_without_the_migration_tool": "the process that it runs asserts",
    "test_sensors_that_can_keep_the_profile_pass": "its sisters show what is refused",
    "test_a_value_that_the_profile_leaves_open_may_be_any": "its sisters show what is refused",
}
"""Tests that pass if nothing is raised, and why that is enough."""
CONDITIONAL = {
    "test_no_refusal_of_a_wrong_value_speaks_the_language_of_the_library": "of any data",
    "test_any_override_is_applied_or_a_config_error": "of any data",
    "test_any_data_is_a_calibration_or_an_error_of_ours": "of any data",
    "test_pairs_are_right_whatever_the_phases_drops_and_jitter": "of any arrivals",
    "test_a_search_on_this_machine_ends_quickly_and_without_an_exception_of_the_library": (
        "what is plugged in is not ours to choose"
    ),
}
"""Tests that may end without an assertion, and why."""


def name_of(call: ast.Call) -> str:
    match call.func:
        case ast.Attribute(attr=name) | ast.Name(id=name):
            return name
        case _:
            return ""


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def judging_helpers() -> set[str]:
    """Plain functions beside the tests that assert something, or call one that does."""
    plain = [
        function
        for tree in TREES.values()
        for function in getattr(tree, "body", [])
        if isinstance(function, ast.FunctionDef)
        and not function.name.startswith("test_")
        and not any("fixture" in ast.unparse(one) for one in function.decorator_list)
    ]
    known: set[str] = set()
    while new := {one.name for one in plain if any(judgements(one, known))} - known:
        known |= new
    return known


def judgements(function: ast.FunctionDef, helpers: set[str]) -> Iterator[ast.AST]:
    for node in ast.walk(function):
        if isinstance(node, ast.Assert):
            yield node
        elif isinstance(node, ast.Call):
            name, is_plain = name_of(node), isinstance(node.func, ast.Name)
            if name in JUDGES or name.startswith("assert_") or (is_plain and name in helpers):
                yield node


def conditional(function: ast.FunctionDef) -> set[ast.AST]:
    """Return all that runs only under a condition that has no other branch, or after an error."""
    found: set[ast.AST] = set()
    for node in ast.walk(function):
        if isinstance(node, ast.If) and not node.orelse:
            found.update(below for statement in node.body for below in ast.walk(statement))
        if isinstance(node, ast.ExceptHandler):
            found.update(ast.walk(node))
    return found


def looks_at_words(function: ast.FunctionDef) -> bool:
    """Whether each `raises` says what the message must hold, or keeps the error."""
    return all(
        item.context_expr.keywords or item.optional_vars
        for node in ast.walk(function)
        if isinstance(node, ast.With)
        for item in node.items
        if isinstance(item.context_expr, ast.Call)
        and name_of(item.context_expr) == "raises"
        and ast.unparse(item.context_expr.args[0]) != "KeyboardInterrupt"
    )


HELPERS = judging_helpers()
TESTS = {
    f"{path}::{function.name}": function
    for path, tree in TREES.items()
    for function in functions(tree)
    if function.name.startswith("test_")
}


def test_every_test_asserts_something():
    silent = {name for name, test in TESTS.items() if not any(judgements(test, HELPERS))}
    assert {name.rpartition("::")[2] for name in silent} == set(SILENT)


def test_no_test_asserts_only_under_a_condition():
    made = {name: set(judgements(test, HELPERS)) for name, test in TESTS.items()}
    never = {name for name, some in made.items() if some and some <= conditional(TESTS[name])}
    assert {name.rpartition("::")[2] for name in never} == set(CONDITIONAL)


def test_a_test_that_promises_words_reads_them():
    promised = {name: test for name, test in TESTS.items() if WORDS.search(test.name)}
    assert len(promised) > 100
    assert [name for name, test in promised.items() if not looks_at_words(test)] == []
