"""A contract of import-linter: every package says what it may import, and nothing else is allowed.

A list of what is forbidden forgets the packages that come later; a list of what is allowed fails
until they have a line.
"""

import sys
from collections.abc import Iterable, Iterator
from typing import NamedTuple, cast

import grimp
from importlinter import Contract, ContractCheck, fields, output


class Import(NamedTuple):
    """One import between two packages."""

    here: str
    there: str
    where: str
    """The two modules."""


class AllowContract(Contract):
    """Each package imports only what its line allows.

    Configuration options:
        rooms: lines of `package: name, name ...`. A package is a child of a root package, or a
            root package with all below it that has no line of its own. A name is a package or a
            library; what allows a package allows all below it.
    """

    type_name = "allow"

    rooms = fields.ListField(subfield=fields.StringField())

    def check(self, graph: grimp.ImportGraph, verbose: bool) -> ContractCheck:
        """Compare every direct import with the line of the package that it stands in."""
        lines = dict(_line(line) for line in cast("list[str]", self.rooms))
        return ContractCheck(kept=not (broken := broken_lines(graph, lines)), metadata={"": broken})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print each import that no line allows, and each name that no import needs."""
        for line in check.metadata[""]:
            output.print_error(line)


def broken_lines(graph: grimp.ImportGraph, lines: dict[str, set[str]]) -> list[str]:
    """Return what is wrong, one line each.

    Args:
        graph: the imports.
        lines: by package: the names that it may import.
    """
    imports = list(_imports(graph, lines))
    unasked = [
        f"{one.here} may not import {one.there}: {one.where}"
        for one in imports
        if not _is_among(one.there, lines.get(one.here, set()))
    ]
    unused = [
        f"{here} does not import {name}: take it out of its line"
        for here, names in sorted(lines.items())
        for name in sorted(names)
        if not any(one.here == here and _is_among(one.there, {name}) for one in imports)
    ]
    return unasked + unused


def _imports(graph: grimp.ImportGraph, rooms: Iterable[str]) -> Iterator[Import]:
    roots = {room.partition(".")[0] for room in rooms}
    for module in sorted(graph.modules):
        if module.partition(".")[0] not in roots:
            continue
        here = _room(module, rooms)
        for imported in sorted(graph.find_modules_directly_imported_by(module)):
            is_ours = imported.partition(".")[0] in roots
            there = _room(imported, rooms) if is_ours else imported
            if there != here and there not in sys.stdlib_module_names:
                yield Import(here, there, f"{module} -> {imported}")


def _line(text: str) -> tuple[str, set[str]]:
    room, _, names = text.partition(":")
    return room.strip(), {name.strip() for name in names.split(",") if name.strip()}


def _room(module: str, rooms: Iterable[str]) -> str:
    """Return the package whose line holds for a module."""
    root, *below = module.split(".")
    child = ".".join([root, *below[:1]])
    return root if root in rooms and child not in rooms else child


def _is_among(there: str, names: set[str]) -> bool:
    return any(there == name or there.startswith(f"{name}.") for name in names)
