"""The tests that run a line, quickest first."""

import ast
import json
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import coverage

from benchmarks.mutants.recorder import SETUP

PACKAGES = {"rig": "rig", "rig_drivers": "drivers/rig_drivers", "rig_sim": "sim/rig_sim"}
"""Name of every package and its folder."""


@dataclass(frozen=True)
class Piece:
    """A statement at the top of a file: lines, the name it makes, whether coverage sees it run."""

    first: int
    last: int
    name: str
    is_seen: bool


class Covering:
    """Answers which tests run a line.

    The lines of a machine-code kernel and those that run at import are seen by no coverage: their
    tests are those that run a line which names what they make, and so on outwards.
    """

    def __init__(self, tree: Path, record: Path) -> None:
        self._data = coverage.CoverageData(str(record / "lines"))
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
        self._pieces = {path: _pieces(text) for path, text in self._sources.items()}
        self._measured = {
            str(Path(file).resolve().relative_to(tree.resolve())): file
            for file in self._data.measured_files()
        }

    def duration_s(self, tests: Iterable[str]) -> float:
        """Return how long these tests take together."""
        return sum(self._durations_s[test] for test in tests)

    def tests(self, path: str, line: int) -> list[str]:
        """Return the names of the tests that run a line, the quickest first."""
        names = self._tests(path, line, set())
        return sorted(names, key=lambda test: (self._durations_s[test], test))

    def _tests(self, path: str, line: int, asked: set[tuple[str, str]]) -> set[str]:
        piece = next((one for one in self._pieces[path] if one.first <= line <= one.last), None)
        if piece is None or piece.is_seen:
            return self._seen(path, line)
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
        return {test for user in users for test in self._tests(*user, asked)}

    def _seen(self, path: str, line: int) -> set[str]:
        file = self._measured.get(path)
        if file is None:
            return set()
        contexts = self._data.contexts_by_lineno(file)
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
        first, last = node.lineno, node.end_lineno or node.lineno
        match node:
            case ast.FunctionDef():
                is_kernel = any("kernel" in ast.unparse(one) for one in node.decorator_list)
                pieces.append(Piece(first, last, node.name, is_seen=not is_kernel))
            case ast.ClassDef():
                pieces += _members(node)
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                pieces.append(Piece(first, last, name, is_seen=False))
            case _:
                pass
    return pieces


def _members(node: ast.ClassDef) -> list[Piece]:
    """Methods are seen; what else stands in a class runs at import, for whoever names the class."""
    return [
        Piece(
            member.lineno,
            member.end_lineno or member.lineno,
            node.name,
            is_seen=isinstance(member, ast.FunctionDef),
        )
        for member in node.body
    ]


def _lines_that_name(text: str, name: str) -> list[int]:
    return sorted(
        {
            node.lineno
            for node in ast.walk(ast.parse(text))
            if (isinstance(node, ast.Name) and node.id == name)
            or (isinstance(node, ast.Attribute) and node.attr == name)
        }
    )
