"""What the pages say is there, is there: files, links, modules, names, verbs and their options.

`make docs` proves the links of the site; this proves the rest, and needs no Sphinx.
"""

import importlib
import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import typer.main
from typer.core import TyperCommand, TyperGroup

from rig.cli.verbs import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")],
    key=str,
)
FOLDERS = ("rig", "drivers", "sim", "tests", "docs", "benchmarks", "calib_profiles")
OTHER_NAMES = {"rig.cameras", "rig.stages", "rig.MultiView"}
"""Look like modules: groups of entry points, the schema of a recording."""
MADE = {"calib_profiles/bench.toml", "benchmarks/out/mutants"}
"""Paths that a reader makes."""
FILES = (".toml", ".sqlite", ".html", ".yml", ".yaml", ".json")
FENCE = re.compile(r"^(`{3,}|~{3,}).*?^\1\s*$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
PATH = re.compile(rf"(?:{'|'.join(FOLDERS)})/[\w./*-]+")
NAME = re.compile(r"(?:rig|rig_drivers|rig_sim|benchmarks)(?:\.[A-Za-z_]\w*)+")


def spans(text: str) -> Iterator[str]:
    """Everything between single backticks outside of code blocks."""
    for found in CODE.finditer(FENCE.sub("", text)):
        yield found.group(1)


def missing_paths(text: str) -> set[str]:
    """Paths of this repository that a page names and that are not there."""
    found = {span for span in spans(text) if PATH.fullmatch(span)} - MADE
    return {path for path in found if not any(ROOT.glob(path.rstrip("/.")))}


def missing_links(page: Path, text: str) -> set[str]:
    """Targets of links to files that are not there."""
    found = {link.partition("#")[0] for link in LINK.findall(FENCE.sub("", text))}
    local = {link for link in found if link and "://" not in link}
    return {link for link in local if not (page.parent / link).exists()}


def is_there(name: str) -> bool:
    """Whether a dotted name is a module, or what a module holds."""
    parts = name.split(".")
    cut = len(parts)
    while cut and not is_module(".".join(parts[:cut])):
        cut -= 1
    if cut in (0, len(parts)):
        return cut > 0
    place: object = importlib.import_module(".".join(parts[:cut]))
    for part in parts[cut:]:
        if not hasattr(place, part):
            return part in getattr(place, "__annotations__", {})
        place = getattr(place, part)
    return True


def is_module(name: str) -> bool:
    """Whether there is such a module; only the packages above it are imported."""
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def table_names(text: str) -> Iterator[str]:
    """Modules in the last column of tables that are headed "module of `package`"."""
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        package = re.search(r"module of `([\w.]+)`", table)
        if package:
            for row in table.splitlines()[2:]:
                for name in CODE.findall(row.rstrip("| ").rpartition("|")[2]):
                    yield f"{package.group(1)}.{name}"


def missing_names(text: str) -> set[str]:
    """Dotted names of our packages that a page names and that do not exist."""
    words = {word for span in spans(text) for word in re.split(r"[\s(),=:]+", span)}
    names = {word for word in words if NAME.fullmatch(word) and not word.endswith(FILES)}
    names |= set(table_names(text))
    return {name for name in names - OTHER_NAMES if not is_there(name)}


def shell_lines(text: str) -> Iterator[str]:
    """Calls of rig: in backticks, in fences and in indented blocks, without their comments."""
    blocks = [found.group(0) for found in FENCE.finditer(text)]
    lines = [line for line in text.splitlines() if line.startswith("    ")]
    for line in [*spans(text), *lines, *(line for block in blocks for line in block.splitlines())]:
        command = re.search(r"(?:^|[\s/])rig ([a-z].*)", line.partition("  #")[0])
        if command and re.match(r"\s*(?:\S*/)?rig |\s*[A-Z_]+=\S* rig ", line):
            yield command.group(1)


@cache
def typer_command() -> TyperCommand | TyperGroup:
    """The whole command line, put together once."""
    command = typer.main.get_command(app)
    assert isinstance(command, TyperCommand | TyperGroup)
    return command


def wrong_call(call: str) -> str | None:
    """What a call of rig names that the command line does not have."""
    command = typer_command()
    words = call.split()
    while isinstance(command, TyperGroup) and words:
        name = words.pop(0)
        if "/" in words[:1]:
            return None  # `rig profile list / show`: a list of verbs, not a call
        if name not in command.commands:
            return name
        command = command.commands[name]
    options = {option for parameter in command.params for option in parameter.opts} | {"--help"}
    for word in words:
        option = re.match(r"--[a-z][a-z-]*", word)
        if option and option.group(0) not in options:
            return f"{command.name} {option.group(0)}"
    return None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_names_only_what_is_there(page: Path):
    text = page.read_text()
    assert missing_paths(text) == set()
    assert missing_links(page, text) == set()
    assert missing_names(text) == set()
    assert {call: wrong_call(call) for call in shell_lines(text) if wrong_call(call)} == {}


def test_every_verb_stands_on_the_page_of_the_command_line():
    page = (ROOT / "docs/reference/command-line.md").read_text()
    group = typer_command()
    assert isinstance(group, TyperGroup)
    verbs = {name for name, command in group.commands.items() if not command.hidden}
    assert {verb for verb in verbs if f"`rig {verb}" not in page} == set()


def test_every_package_has_its_line_in_the_house_plan():
    page = (ROOT / "docs/explanations/where-a-line-belongs.md").read_text()
    packages = {path.parent.name for path in (ROOT / "rig").glob("*/__init__.py")}
    assert {package for package in packages if f"`rig/{package}/`" not in page} == set()


def test_every_type_of_the_glossary_is_a_class():
    page = (ROOT / "docs/explanations/glossary.md").read_text()
    named = set(re.findall(r"type `(\w+)`", page))
    sources = "\n".join(path.read_text() for path in (ROOT / "rig").rglob("*.py"))
    assert named >= {"MultiView", "Sighting", "Label"}
    assert {
        name for name in named if not re.search(rf"^class {name}\b", sources, re.MULTILINE)
    } == set()


def test_the_glossary_tells_every_word_once():
    page = (ROOT / "docs/explanations/glossary.md").read_text()
    words = re.findall(r"^(\S.*)\n: ", page, re.MULTILINE)
    assert len(words) >= 50
    assert sorted(words) == sorted(set(words))


def test_what_is_not_there_is_noticed(tmp_path: Path):
    page = tmp_path / "page.md"
    text = (
        "`rig/gone.py` and `rig/errors.py`, `rig.gone.Thing`, `rig.errors.RigError`, "
        "[here](gone.md), [there](page.md#heading), `rig sweeep sim`, `rig sweep sim --sampels 3`"
    )
    page.write_text(text)
    assert missing_paths(text) == {"rig/gone.py"}
    assert missing_links(page, text) == {"gone.md"}
    assert missing_names(text) == {"rig.gone.Thing"}
    assert [wrong_call(call) for call in shell_lines(text)] == ["sweeep", "sweep --sampels"]
