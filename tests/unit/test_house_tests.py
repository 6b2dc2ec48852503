"""The rules of the tests themselves: each asserts something, and what its name promises."""

import ast
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILES = [*sorted((ROOT / "tests").rglob("*.py")), *sorted((ROOT / "rig/testing").rglob("*.py"))]
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


@cache
def trees() -> dict[str, ast.Module]:
    """All tests, parsed when the first of these tests runs: collecting must cost nothing."""
    return {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text()) for path in FILES}


@cache
def below(function: ast.FunctionDef) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(function))


@cache
def judgements(function: ast.FunctionDef) -> frozenset[ast.AST]:
    """Return what may fail in a function by itself: assertions, and calls that judge."""
    return frozenset(
        node
        for node in below(function)
        if isinstance(node, ast.Assert) or (isinstance(node, ast.Call) and judges(name_of(node)))
    )


def judges(name: str) -> bool:
    return name in JUDGES or name.startswith("assert_")


@cache
def plain_calls(function: ast.FunctionDef) -> dict[ast.AST, str]:
    """Return the calls of plain names in a function, each with the name."""
    calls = (node for node in below(function) if isinstance(node, ast.Call))
    return {call: call.func.id for call in calls if isinstance(call.func, ast.Name)}


@cache
def judging_helpers() -> frozenset[str]:
    """Plain functions beside the tests that assert something, or call one that does."""
    plain = [
        function
        for tree in trees().values()
        for function in tree.body
        if isinstance(function, ast.FunctionDef)
        and not function.name.startswith("test_")
        and not any("fixture" in ast.unparse(one) for one in function.decorator_list)
    ]
    known = {one.name for one in plain if judgements(one)}
    while (
        new := {one.name for one in plain if known.intersection(plain_calls(one).values())} - known
    ):
        known |= new
    return frozenset(known)


def all_judgements(function: ast.FunctionDef) -> set[ast.AST]:
    helpers = judging_helpers()
    calls = plain_calls(function).items()
    return set(judgements(function)) | {call for call, name in calls if name in helpers}


def conditional(function: ast.FunctionDef) -> set[ast.AST]:
    """Return all that runs only under a condition that has no other branch, or after an error."""
    found: set[ast.AST] = set()
    for node in below(function):
        if isinstance(node, ast.If) and not node.orelse:
            found.update(inner for statement in node.body for inner in ast.walk(statement))
        if isinstance(node, ast.ExceptHandler):
            found.update(ast.walk(node))
    return found


def looks_at_words(function: ast.FunctionDef) -> bool:
    """Whether each `raises` says what the message must hold, or keeps the error."""
    return all(
        item.context_expr.keywords or item.optional_vars
        for node in below(function)
        if isinstance(node, ast.With)
        for item in node.items
        if isinstance(item.context_expr, ast.Call)
        and name_of(item.context_expr) == "raises"
        and ast.unparse(item.context_expr.args[0]) != "KeyboardInterrupt"
    )


@cache
def all_tests() -> dict[str, ast.FunctionDef]:
    return {
        f"{path}::{node.name}": node
        for path, tree in trees().items()
        for owner in (tree, *(node for node in tree.body if isinstance(node, ast.ClassDef)))
        for node in owner.body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


def test_every_test_asserts_something():
    silent = {name for name, test in all_tests().items() if not all_judgements(test)}
    assert {name.rpartition("::")[2] for name in silent} == set(SILENT)


def test_no_test_asserts_only_under_a_condition():
    made = {name: all_judgements(test) for name, test in all_tests().items()}
    never = {name for name, some in made.items() if some and some <= conditional(all_tests()[name])}
    assert {name.rpartition("::")[2] for name in never} == set(CONDITIONAL)


def test_a_test_that_promises_words_reads_them():
    promised = {name: test for name, test in all_tests().items() if WORDS.search(test.name)}
    assert len(promised) > 100
    assert [name for name, test in promised.items() if not looks_at_words(test)] == []
