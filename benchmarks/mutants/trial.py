"""One fault in a copy of the tree, and whether the tests notice it."""

import ast
import os
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from benchmarks.mutants.covering import PACKAGES
from benchmarks.mutants.operators import Mutation
from benchmarks.mutants.warm import Warm

_LIMIT_S = 60.0
_SLOWER = 6.0
"""A fault that makes its tests this many times slower, beyond `_LIMIT_S`, is noticed: it hangs."""
_FIRST = 25
"""So many tests are run before the others are even imported: most faults fall to them."""
_NOTHING_FAILED = 0
_NOT_COLLECTED = 2
"""pytest's exit code where a file of tests cannot be imported; those above are its own trouble."""


class Verdict(StrEnum):
    """What the tests said of a fault."""

    NOTICED = "noticed"
    HANGS = "hangs"
    """No test failed, but they did not end in time."""
    SURVIVED = "survived"


@dataclass(frozen=True)
class Outcome:
    """What became of a fault, before how many tests at most, and how long it took."""

    mutation: Mutation
    verdict: Verdict
    tests: int
    took_s: float


class Copy:
    """A copy of the tree in which faults are tried one after the other."""

    def __init__(self, tree: Path, folder: Path) -> None:
        self._folder = folder
        ignore = shutil.ignore_patterns(
            ".git", ".venv", "demo", "out", ".hypothesis", "docs/_build"
        )
        shutil.copytree(tree, folder, ignore=ignore, dirs_exist_ok=True)
        self._importers = _importers(folder)
        paths = [str(folder / part) for part in ("", "drivers", "sim")]
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTEST_ADDOPTS": "--hypothesis-profile=ci",
        }
        self._warm = Warm(folder, environment)

    def close(self) -> None:
        """End the process that runs the tests."""
        self._warm.close()

    def try_fault(self, mutation: Mutation, tests: list[str], duration_s: float) -> Outcome:
        """Run the tests of a fault, as they are ordered, until one fails."""
        begin_s = time.monotonic()
        file = self._folder / mutation.path
        source, written = file.read_bytes(), file.stat()
        kept = {code: code.read_bytes() for code in self._machine_code(mutation.path)}
        self._forget_machine_code(mutation.path)
        file.write_bytes(mutation.applied(source))
        try:
            limit_s = _LIMIT_S + _SLOWER * duration_s
            rounds = (tests[:_FIRST], tests[_FIRST:])
            verdicts = (self._judged(names, limit_s) for names in rounds if names)
            verdict = next((v for v in verdicts if v is not Verdict.SURVIVED), Verdict.SURVIVED)
        finally:
            file.write_bytes(source)
            self._forget_machine_code(mutation.path)
            for code, content in kept.items():
                code.write_bytes(content)
            # Machine code counts as current only beside a source of this very time.
            os.utime(file, ns=(written.st_atime_ns, written.st_mtime_ns))
        return Outcome(mutation, verdict, len(tests), time.monotonic() - begin_s)

    def require_sound(self, tests: list[str]) -> None:
        """See that tests pass without a fault: else every fault would seem to be noticed.

        Raises:
            RuntimeError: they do not.
        """
        code = self._run(tests, _LIMIT_S)
        if code != _NOTHING_FAILED:
            raise RuntimeError(f"without any fault, pytest ends with {code} on {', '.join(tests)}")

    def _judged(self, tests: list[str], limit_s: float) -> Verdict:
        code = self._run(tests, limit_s)
        if code is None:
            return Verdict.HANGS
        if code > _NOT_COLLECTED:
            raise RuntimeError(f"pytest itself ends with {code} on {', '.join(tests[:9])} ...")
        return Verdict.SURVIVED if code == _NOTHING_FAILED else Verdict.NOTICED

    def _run(self, tests: list[str], limit_s: float) -> int | None:
        names = self._folder / ".mutant-tests"
        names.write_text("\n".join(tests))
        return self._warm.run(names, limit_s)

    def _machine_code(self, path: str) -> Iterator[Path]:
        """Yield what was compiled from this file, or from a file that calls it."""
        for other in (path, *self._importers.get(path, ())):
            file = self._folder / other
            yield from (file.parent / "__pycache__").glob(f"{file.stem}.*.nb?")

    def _forget_machine_code(self, path: str) -> None:
        for code in list(self._machine_code(path)):
            code.unlink()


def _importers(folder: Path) -> dict[str, set[str]]:
    """Return for every file all files that import it, directly or through others."""
    module_of = {
        ".".join((package, *path.relative_to(folder / below).with_suffix("").parts)): str(
            path.relative_to(folder)
        )
        for package, below in PACKAGES.items()
        for path in (folder / below).rglob("*.py")
    }
    direct: dict[str, set[str]] = {path: set() for path in module_of.values()}
    for path in module_of.values():
        for node in ast.walk(ast.parse((folder / path).read_text())):
            if isinstance(node, ast.ImportFrom) and node.module in module_of:
                direct[module_of[node.module]].add(path)
    return {path: _reached(path, direct) for path in direct}


def _reached(path: str, direct: dict[str, set[str]]) -> set[str]:
    reached: set[str] = set()
    waiting = [path]
    while waiting:
        for other in direct[waiting.pop()] - reached:
            reached.add(other)
            waiting.append(other)
    return reached
