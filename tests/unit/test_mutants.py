"""The tool that tries faults: which it makes, which tests it finds, and what it lists as equal."""

import json
from pathlib import Path

import coverage
import pytest

from benchmarks.mutants.__main__ import told
from benchmarks.mutants.covering import Covering
from benchmarks.mutants.equivalent import equivalents
from benchmarks.mutants.operators import mutations
from benchmarks.mutants.recorder import plain
from benchmarks.mutants.trial import Verdict

ROOT = Path(__file__).resolve().parents[2]


def faults_of(text: str) -> set[str]:
    """Whole sources with one fault each."""
    return {one.applied(text.encode()).decode() for one in mutations("it.py", text.encode())}


@pytest.mark.parametrize(
    ("text", "faulty"),
    [
        ("x = a < b", {"x = (a <= b)"}),
        ("x = a is None", {"x = (a is not None)"}),
        ("x = a and b", {"x = (a or b)"}),
        ("x = not a", {"x = (a)"}),
        ("x = -a", {"x = (a)"}),
        ("x = a + 2", {"x = (a - 2)", "x = a + (3)"}),
        ("x = min(a, b)", {"x = (max(a, b))"}),
        ("x = True", {"x = (False)"}),
        ("x += y", {"x -= y"}),
        ("x = '\u00fc' if a == b else c", {"x = '\u00fc' if (a != b) else c"}),
        ("def f(a: int = 1) -> int: ...", {"def f(a: int = (2)) -> int: ..."}),
        ("for a in b:\n    break", {"for a in b:\n    continue"}),
    ],
)
def test_each_operator_has_its_fault(text: str, faulty: set[str]):
    assert faults_of(text) == faulty


@pytest.mark.parametrize(
    "text",
    [
        "x = f'{a + 1}'",
        "x = 'a' + b",
        "raise ValueError(a + 1)",
        "x: tuple[1] = y",
        "@cache(1)\ndef f(): ...",
        "__all__ = ['a', *range(2)]",
        '"""A docstring: a < b."""',
        "x = 0.5",
    ],
)
def test_what_no_test_should_care_for_is_left_alone(text: str):
    assert faults_of(text) == set()


def test_every_fault_that_is_listed_as_equal_can_be_made():
    there = {
        (path, one.row, " ".join(one.before.split()), " ".join(one.after.split()))
        for path in {path for path, *_ in equivalents()}
        for one in mutations(path, (ROOT / path).read_bytes())
    }
    assert set(equivalents()) - there == set()


@pytest.mark.parametrize(
    ("nodeid", "name"),
    [
        ("a.py::test_b", "a.py::test_b"),
        ("a.py::test_b@/at/a.py", "a.py::test_b"),
        ("a.py::test_b[x@y]", "a.py::test_b[x@y]"),
        ("a.py::test_b[x@y]@group", "a.py::test_b[x@y]"),
    ],
)
def test_the_group_of_a_test_is_no_part_of_its_name(nodeid: str, name: str):
    assert plain(nodeid) == name


TREE = {
    "rig/it.py": (
        "LIMIT = 3\n"  # 1
        "def _twice(a, b=2):\n"  # 2
        "    return a * b\n"  # 3
        "TABLE = _twice(2)\n"  # 4
        "def used(a=LIMIT):\n"  # 5
        '    """Say."""\n'  # 6
        "    return a + TABLE\n"  # 7
        "@kernel()\n"  # 8
        "def _machine(a):\n"  # 9
        "    return a - 1\n"  # 10
        "def asks(a):\n"  # 11
        "    return _machine(a)\n"  # 12
        "def idle(a):\n"  # 13
        "    return a + 1\n"  # 14
    ),
    "tests/test_it.py": "from rig.it import used, asks\n",
    "tests/test_table.py": "from rig import it\nassert it.TABLE == 4\n",
}
RAN = {
    "tests/test_it.py::test_used": [7],
    "tests/test_it.py::test_asks": [12],
    "tests/test_table.py::test_table": [],
}


@pytest.fixture
def covering(tmp_path: Path) -> Covering:
    for name, text in TREE.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    for folder in ("drivers/rig_drivers", "sim/rig_sim"):
        (tmp_path / folder).mkdir(parents=True)
    lines = coverage.CoverageData(str(tmp_path / "lines"))
    for test, rows in RAN.items():
        lines.set_context(test)
        lines.add_lines({"rig/it.py": rows})
    lines.set_context("")
    lines.add_lines({"rig/it.py": [1, 2, 3, 4, 5, 9, 11, 13]})
    lines.write()
    took_s = {test: 1.0 + number for number, test in enumerate(RAN)}
    (tmp_path / "durations.alone.json").write_text(json.dumps(took_s))
    return Covering(tmp_path, tmp_path)


@pytest.mark.parametrize(
    ("line", "tests"),
    [
        (7, {"test_used"}),
        (5, {"test_used"}),  # what is not given is as old as the function
        (10, {"test_asks"}),  # machine code belongs to whoever calls it
        (4, {"test_used", "test_table"}),  # what runs at import, to whoever names it
        (3, {"test_used", "test_table"}),
        (1, {"test_used"}),
        (14, set()),
    ],
)
def test_the_tests_of_a_line_are_found(covering: Covering, line: int, tests: set[str]):
    found = covering.tests("rig/it.py", line)
    assert {name.partition("::")[2] for name in found} == tests


def test_the_quickest_test_is_tried_first(covering: Covering):
    assert covering.tests("rig/it.py", 4) == ["tests/test_it.py::test_used",
                                              "tests/test_table.py::test_table"]  # fmt: skip
    assert covering.quickest(1) == ["tests/test_it.py::test_used"]
    assert covering.duration_s(RAN) == 6.0


def test_the_same_fault_twice_on_a_line_is_two_faults():
    both = [one for one in mutations("it.py", b"x = [1, 1]") if one.after == "(2)"]
    assert len(both) == 2
    assert len({one.key for one in both}) == 2
    assert len({str(one) for one in both}) == 1


def test_what_was_tried_is_counted_and_the_rest_is_told():
    faults = list(mutations("it.py", b"x = a < b\ny = a and b\nz = not a\nw = -a\n"))
    said = (Verdict.NOTICED, Verdict.HANGS, Verdict.SURVIVED)
    verdicts = {fault.key: verdict for fault, verdict in zip(faults, said, strict=False)}
    head, survivor = told(faults, verdicts)
    assert "2 of 3 faults noticed (66.7 %), 1 of them by the clock alone" in head
    assert "1 not yet tried" in head
    assert str(faults[2]) in survivor
