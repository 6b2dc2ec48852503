"""The tests that run a line, those first that are likely to judge it."""

import ast
import json
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import coverage

from benchmarks.mutants.recorder import LINES, SETUP

PACKAGES = {"rig": "rig", "rig_drivers": "drivers/rig_drivers", "rig_sim": "sim/rig_sim"}
"""Name of every package and its folder."""


@dataclass(frozen=True)
class Piece:
    """A statement at the top of a file or class.

    Attributes:
        first: Its first line.
        last: Its last.
        name: What it makes.
        body: First line of what runs when it is called; what stands before, such as the values of
            parameters that are not given, runs at import. None where all does.
        is_seen: Whether coverage sees the body run.
        is_method: Whether it is a function in a class.
    """

    first: int
    last: int
    name: str
    body: int | None
    is_seen: bool
    is_method: bool = False


class Covering:
    """Answers which tests run a line.

    The lines of a machine-code kernel and those that run at import are seen by no coverage: their
    tests are those that run a line which names what they make, and so on outwards, and those of
    test files that import and name it.
    """

    def __init__(self, tree: Path, record: Path) -> None:
        self._data = coverage.CoverageData(str(record / LINES))
        self._data.read()
        self._durations_s: dict[str, float] = {}
        for file in record.glob("durations.*.json"):
            self._durations_s |= json.loads(file.read_text())
        self._by_file: dict[str, list[str]] = defaultdict(list)
        for test in self._durations_s:
            self._by_file[test.partition("::")[0]].append(test)
        self._sources = {
            str(path.relative_to(tree)): path.read_text()
            for folder in PACKAGES.values()
            for path in sorted((tree / folder).rglob("*.py"))
        }
        self._modules = {
            path.as_posix(): ".".join((package, *path.relative_to(folder).with_suffix("").parts))
            for package, folder in PACKAGES.items()
            for path in map(Path, self._sources)
            if path.is_relative_to(folder)
        }
        self._test_sources = {file: (tree / file).read_text() for file in self._by_file}
        self._pieces = {path: _pieces(text) for path, text in self._sources.items()}

    def quickest(self, count: int = 9) -> list[str]:
        """Return the names of the tests that take least time."""
        return sorted(self._durations_s, key=lambda test: (self._durations_s[test], test))[:count]

    def duration_s(self, tests: Iterable[str]) -> float:
        """Return how long these tests take together."""
        return sum(self._durations_s[test] for test in tests)

    def tests(self, path: str, line: int) -> list[str]:
        """Return the names of the tests that run a line, those of its importers first.

        Of these, and of the others, the quickest first.
        """
        module = self._modules[path]
        own = {file for file, text in self._test_sources.items() if module in _imported(text)}

        def rank(test: str) -> tuple[bool, float, str]:
            return test.partition("::")[0] not in own, self._durations_s[test], test

        return sorted(self._tests(path, line, set()), key=rank)

    def _tests(self, path: str, line: int, asked: set[tuple[str, str]]) -> set[str]:
        pieces = [one for one in self._pieces[path] if one.first <= line <= one.last]
        if not pieces:
            return self._seen(path, line)
        # Several: names that one statement makes together.
        return {test for piece in pieces for test in self._of_piece(path, line, piece, asked)}

    def _of_piece(
        self, path: str, line: int, piece: Piece, asked: set[tuple[str, str]]
    ) -> set[str]:
        if piece.is_seen and piece.body is not None:
            seen = self._seen(path, max(line, piece.body))
            is_called = line >= piece.body and self._seen(path, piece.body)
            if seen or is_called or piece.is_method:
                return seen
        if (path, piece.name) in asked:
            return set()
        asked.add((path, piece.name))
        users = [
            (other, number)
            for other, text in self._sources.items()
            if other == path or piece.name in text
            for number in _lines_that_name(text, piece.name)
            if not (other == path and piece.first <= number <= piece.last)
        ]
        named = {test for user in users for test in self._tests(*user, asked)}
        return named | self._of_importers(path, piece.name)

    def _of_importers(self, path: str, name: str) -> set[str]:
        """Tests of the files that import a file and name what it makes."""
        module = self._modules[path]
        return {
            test
            for file, text in self._test_sources.items()
            if name in text and module in _imported(text)
            for test in self._by_file[file]
        }

    def _seen(self, path: str, line: int) -> set[str]:
        contexts = self._data.contexts_by_lineno(path)
        # A piece that spans lines counts where it begins; look back to the line that is a key.
        key = next((at for at in range(line, max(line - 12, 0), -1) if contexts.get(at)), None)
        tests: set[str] = set()
        for context in contexts.get(key, []) if key is not None else []:
            if context.endswith(SETUP):
                tests.update(self._by_file[context.removesuffix(SETUP).partition("::")[0]])
            elif context in self._durations_s:
                tests.add(context)
        return tests


def _pieces(text: str) -> list[Piece]:
    pieces: list[Piece] = []
    for node in ast.parse(text).body:
        match node:
            case ast.FunctionDef():
                pieces.append(_function(node, node.name))
            case ast.ClassDef():
                pieces += [_member(member, node.name) for member in node.body]
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                pieces.append(Piece(node.lineno, _last(node), name, body=None, is_seen=False))
            case ast.Assign(targets=[ast.Tuple(elts=names)]):
                pieces += [
                    Piece(node.lineno, _last(node), name.id, body=None, is_seen=False)
                    for name in names
                    if isinstance(name, ast.Name)
                ]
            case _:
                pass
    return pieces


def _function(node: ast.FunctionDef, name: str) -> Piece:
    is_kernel = any("kernel" in ast.unparse(one) for one in node.decorator_list)
    is_told = ast.get_docstring(node) is not None and len(node.body) > 1
    body = node.body[1 if is_told else 0].lineno
    first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
    return Piece(first, _last(node), name, body, is_seen=not is_kernel)


def _member(node: ast.stmt, name: str) -> Piece:
    """Methods are seen; what else stands in a class runs at import, for whoever names the class."""
    if isinstance(node, ast.FunctionDef):
        return replace(_function(node, name), is_method=True)
    return Piece(node.lineno, _last(node), name, body=None, is_seen=False)


def _last(node: ast.stmt) -> int:
    return node.end_lineno or node.lineno


@cache
def _imported(text: str) -> frozenset[str]:
    """Names of the modules that a file imports, and of what it imports from them."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
    return frozenset(found)


@cache
def _lines_that_name(text: str, name: str) -> list[int]:
    return sorted(
        {
            node.lineno
            for node in ast.walk(ast.parse(text))
            if (isinstance(node, ast.Name) and node.id == name)
            or (isinstance(node, ast.Attribute) and node.attr == name)
        }
    )
