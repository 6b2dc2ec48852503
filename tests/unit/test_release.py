"""Facts about the project that stand in two files because other people's tools read them there."""

import re
import tomllib
from pathlib import Path

import rig

ROOT = Path(__file__).resolve().parents[2]
PINS = dict(
    line.split("==") for line in (ROOT / "constraints.txt").read_text().lower().splitlines() if line
)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_the_version_has_one_source():
    assert "version" not in PROJECT["project"]
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["hatch"]["version"]["path"] == "rig/__init__.py"
    assert re.fullmatch(r"\d+\.\d+\.\d+", rig.__version__)


def test_the_changelog_begins_with_what_is_not_released_or_with_this_version():
    sections = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert sections[0] in ("Unreleased", rig.__version__)


def test_every_commit_is_formatted_by_the_ruff_of_the_checks():
    hooks = (ROOT / ".pre-commit-config.yaml").read_text()
    versions = set(re.findall(r"ruff==([\d.]+)", hooks))
    assert versions == {PINS["ruff"]}


def test_pins_are_plain_versions_of_every_dependency():
    assert all(re.fullmatch(r"[\w.]+", version) for version in PINS.values())
    extras = PROJECT["project"]["optional-dependencies"]
    wanted = [PROJECT["project"]["dependencies"], *extras.values()]
    names = {re.split(r"[\s<>=~!;\[]", text)[0].lower() for group in wanted for text in group}
    assert {name for name in names if name not in PINS and not name.startswith("epirig")} == set()


def test_the_workflow_and_make_run_the_same_checks():
    assert "run: .ci/run" in (ROOT / ".github/workflows/check.yml").read_text()
    script = (ROOT / ".ci/run").read_text()
    assert "make check" in script
    assert "make docs" in script
