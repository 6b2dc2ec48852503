"""`rig capture --view`, from the command line to a page."""

import re
import socket
from contextlib import closing
from pathlib import Path

import pytest

from rig.testing.simulated import PROFILE
from tests.support.command import Command
from tests.support.looking_on import SOON_S, LookingOn, looking_on


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> LookingOn:
    """Takes the browser's place."""
    return looking_on(monkeypatch)


@pytest.mark.slow
def test_a_page_sees_the_capture(rig: Command, page: LookingOn, tmp_path: Path):
    out = tmp_path / "out"
    done = rig(
        "capture", str(PROFILE), "--slopes-only", "--view", "--frames", "5", "--out", str(out)
    )
    page.join(SOON_S)
    assert done.code == 0, done.err
    assert not page.is_alive()
    told = re.findall(r"^rig: live page: (\S+)$", done.err, re.MULTILINE)
    assert told == page.address
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", told[0])
    assert len(page.headers) > 0
    assert page.headers[-1]["unit"] == "px"
    assert page.headers[-1]["rig"] == "simulated-rig"
    assert page.state["save"] == f"every frame is written into {out} already"
    assert page.state["record"] is None


def test_a_taken_port_is_one_line_and_nothing_is_captured(rig: Command, tmp_path: Path):
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        port = taken.getsockname()[1]
        done = rig(
            "capture", str(PROFILE), "--slopes-only", "--view", "--view-port", str(port),
            "--frames", "1", "--out", str(tmp_path / "out"),
        )  # fmt: skip
    assert done.code == 1
    assert done.err.count("\n") == 1
    assert f"port {port}: cannot listen there: Address already in use" in done.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("verb", ["capture", "sweep", "calibrate"])
def test_where_belongs_to_view(rig: Command, verb: str):
    done = rig(verb, str(PROFILE), "--view-port", "8000")
    assert done.code == 2
    assert "--view-host and --view-port belong to --view" in done.err


@pytest.mark.slow
def test_a_page_sees_the_sweep(rig: Command, page: LookingOn):
    places = ("480", "540", "600", "680", "760", "850", "950")
    done = rig("sweep", str(PROFILE), "--at-mm", *places, "--samples", "1", "--view", "--json")
    page.join(SOON_S)
    assert done.code in (0, 3), done.err
    assert not page.is_alive()
    last = page.headers[-1]
    assert last["mode"] == "sweep"
    assert [stop["mm"] for stop in last["stops"]][:7] == [float(mm) for mm in places]
    assert last["result"]["model"] == done.json["curve"]["model"], "the last word reaches the page"
    assert page.headers[0]["at"] is None, "it is there before the stage moves"
