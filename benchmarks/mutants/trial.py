"""One fault in a copy of the tree, and whether the tests notice it."""

import ast
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mutants.covering import PACKAGES
from benchmarks.mutants.operators import Mutation

_LIMIT_S = 120.0
_SLOWER = 6.0
"""A fault that makes its tests this many times slower, beyond `_LIMIT_S`, is noticed: it hangs."""
_NOTHING_FAILED = 0


@dataclass(frozen=True)
class Outcome:
    """What became of a fault: noticed or not, by how many tests at most, and how long it took."""

    mutation: Mutation
    is_killed: bool
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

    def try_fault(self, mutation: Mutation, tests: list[str], duration_s: float) -> Outcome:
        """Run the tests of a fault, until the first fails."""
        begin_s = time.monotonic()
        file = self._folder / mutation.path
        source = file.read_bytes()
        self._forget_machine_code(mutation.path)
        file.write_bytes(mutation.applied(source))
        try:
            is_killed = bool(tests) and self._fails(tests, _LIMIT_S + _SLOWER * duration_s)
        finally:
            file.write_bytes(source)
            self._forget_machine_code(mutation.path)
        return Outcome(mutation, is_killed, len(tests), time.monotonic() - begin_s)

    def _fails(self, tests: list[str], limit_s: float) -> bool:
        names = self._folder / ".mutant-tests"
        names.write_text("\n".join(tests))
        paths = [str(self._folder / part) for part in ("", "drivers", "sim")]
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTEST_ADDOPTS": "--hypothesis-profile=ci",
        }
        quiet = ("-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "--no-header")
        command = [sys.executable, "-m", "pytest", *quiet, f"@{names}"]
        try:
            ran = subprocess.run(
                command,
                cwd=self._folder,
                env=environment,
                timeout=limit_s,
                capture_output=True,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return True
        return ran.returncode != _NOTHING_FAILED

    def _forget_machine_code(self, path: str) -> None:
        """Delete what was compiled from this file, or from a file that calls it."""
        for other in (path, *self._importers.get(path, ())):
            file = self._folder / other
            for code in (file.parent / "__pycache__").glob(f"{file.stem}.*.nb?"):
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
