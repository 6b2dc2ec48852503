"""`rig store` as an operator uses it: words, JSON and exit codes."""

from pathlib import Path

import pytest

from tests.support.command import Command
from tests.support.kept_stores import CONCLUDED, FILES, SAMPLES, TAKEN, kept_store, sample_place


@pytest.mark.slow
def test_a_day_of_an_operator(rig: Command, tmp_path: Path):
    with kept_store(tmp_path / "bench") as store:
        folder = sample_place(store, TAKEN)
        (folder.parent / "sample_08").mkdir()
    found = rig("store", "verify", "--json")
    assert (found.code, found.json["damaged"]) == (0, 0)
    assert [f["kind"] for f in found.json["findings"]] == ["orphan"]
    assert "1 to put in order with: rig store verify --repair" in rig("store", "verify").out
    mended = rig("store", "verify", "--repair", "--json").json
    assert ([f["kind"] for f in mended["repaired"]], mended["findings"]) == (["orphan"], [])
    made = rig("store", "backup", tmp_path / "b", "--json").json
    assert (made["sweeps"], made["samples"], made["files"]) == (2, 2 * SAMPLES, 2 * FILES)
    weighed = rig("store", "du", "--json").json
    assert [(r["rig"], r["sweeps"]) for r in weighed["rigs"]] == [("bench", 2)]
    assert rig("store", "du").out.splitlines()[-1].startswith("together ")
    told = rig("store", "prune", "--verdict", "passed")
    assert told.out.splitlines()[-1].endswith("would go; do it with --yes")
    pruned = rig("store", "prune", "--verdict", "passed", "--yes", "--json").json
    assert [s["sweep"] for s in pruned["sweeps"]] == [CONCLUDED]
    (folder / "left.png").write_bytes(b"x")
    damaged = rig("store", "verify")
    assert damaged.code == 3
    assert "rig: 1 damaged or lost" in damaged.err
    place = f"sqlite:///{tmp_path}/c/rig.sqlite"
    back = rig("store", "restore", tmp_path / "b", "--db", place, "--json").json
    assert (back["samples"], back["files"]) == (2 * SAMPLES, 2 * FILES)
    assert rig("store", "verify", "--db", place).code == 0
    moved = rig("store", "move", tmp_path / "d", "--db", place, "--json").json
    assert moved["frames"] == str(tmp_path / "d" / "frames")
    there = f"sqlite:///{tmp_path}/d/rig.sqlite"
    new = f"sqlite:///{tmp_path}/e/rig.sqlite"
    refused = rig("store", "migrate", new, "--db", there)
    assert (refused.code, "--copy-frames" in refused.err) == (1, True)
    rows = rig("store", "migrate", new, "--db", there, "--copy-frames", "--json").json["rows"]
    assert rows["samples"] == 2 * SAMPLES


def test_what_was_damaged_before_a_backup_ends_it_with_3(rig: Command, tmp_path: Path):
    with kept_store(tmp_path / "bench") as store:
        (sample_place(store, TAKEN) / "left.png").unlink()
    answer = rig("store", "backup", tmp_path / "b")
    assert answer.code == 3
    assert answer.err.splitlines()[-1].startswith("rig: 1 images were damaged or missing")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "say whose images"),
        (("--older-than", "nan"), "must be at least 0"),
        (("--older-than", "1e12"), "no sweep is so old"),
    ],
)
def test_nothing_is_pruned_by_a_slip(
    rig: Command, tmp_path: Path, options: tuple[str, ...], says: str
):
    kept_store(tmp_path / "bench").close()
    answer = rig("store", "prune", "--yes", *options)
    assert answer.code == 2
    assert says in " ".join(answer.err.replace("│", " ").split())
    assert rig("store", "verify", "--json").json["pruned"] == 0


@pytest.mark.parametrize("verb", ["verify", "du", "prune", "backup", "move", "migrate"])
def test_a_store_that_is_not_there_is_named(rig: Command, tmp_path: Path, verb: str):
    more = {"prune": ("--rig", "x"), "backup": (tmp_path / "b",), "move": (tmp_path / "b",),
            "migrate": ("sqlite:///x.sqlite",)}  # fmt: skip
    url = f"sqlite:///{tmp_path}/none.sqlite"
    answer = rig("store", verb, *more.get(verb, ()), "--db", url)
    assert (answer.code, "there is none" in answer.err) == (1, True)
    assert list(tmp_path.iterdir()) == []
