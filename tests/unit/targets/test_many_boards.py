"""A share of `python -m benchmarks.boards`: boards where they are, nothing where there is none."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.boards import __main__ as boards
from benchmarks.boards.looks import Lens
from benchmarks.boards.trials import places, wide_board
from rig.targets.checkerboard import Checkerboard

SEED = 40


@pytest.mark.slow
def test_no_texture_is_a_board() -> None:
    rows = [row for number in range(28) for row in boards.empty_rows(number, SEED)]
    assert [row for row in rows if "corners" in row] == []


@pytest.mark.slow
def test_boards_through_wide_lenses_are_found() -> None:
    rows = [row for number in range(40) for row in boards.wide_rows(number, SEED)]
    assert [row for row in rows if not boards.is_right(row)] == []


@pytest.mark.slow
def test_reasons_name_the_fault() -> None:
    rows = [row for number in range(20) for row in boards.faulty_rows(number, SEED)]
    refused = [row for row in rows if "reason" in row]
    assert len(refused) > 20
    assert sum(row["right"] for row in refused) >= 0.9 * len(refused)
    assert [row for row in rows if "worst_px" in row and not boards.is_right(row)] == []


def test_what_was_judged_is_not_judged_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []

    def rows(number: int, seed: int) -> list[boards.Row]:
        asked.append(number)
        return [{"target": "charuco", "kind": "tiles", "reason": "not-found", "ms": 1.0}]

    monkeypatch.setattr(boards, "PARTS", {"empty": rows})
    path = tmp_path / "rows.jsonl"
    old = {"part": "empty", "number": 1, "seed": 7, "target": "charuco", "reason": "", "ms": 2.0}
    path.write_text(json.dumps(old) + "\n" + json.dumps(old | {"seed": 8}) + "\n" + '{"part": "em')
    found = boards.work(path, 7, {"empty": 3}, 100.0)
    assert asked == [0, 2]
    assert [row["number"] for row in found] == [1, 0, 2]
    again = boards.work(path, 7, {"empty": 3}, 100.0)
    assert len(again) == 3
    assert asked == [0, 2]
    assert "charuco: 0 false positives in 3 without a board" in boards.tables(again)


def test_the_lens_of_the_renderings_is_its_formula() -> None:
    """r = f tan(k angle) / k; at the border of the picture the angle is half the field of view."""
    lens = Lens(161, 121, 150.0, 0.4)
    turn = np.radians(75.0)
    edge = lens.shown(np.array([np.sin(turn), 0.0, np.cos(turn)]))
    assert edge == pytest.approx([80.0 + 80.5, 60.0])
    rays = lens.rays().astype(np.float64)
    y, x = np.mgrid[: rays.shape[0], : rays.shape[1]]
    back = lens.shown(rays)
    apart_px = np.abs(back - (np.stack([x, y], axis=-1) + 0.5) / 2 + 0.5)
    assert apart_px.max() < 2e-3


def test_a_wide_board_is_drawn_where_its_truth_says() -> None:
    board = Checkerboard(5, 4, 25.0)
    trial = wide_board(0, SEED, board)
    assert trial.corners is not None
    assert trial.corners.shape == (20, 2)
    assert places(board, 1).shape == (6, 7, 2)
    limit = np.array(trial.image.shape[::-1]) - 4
    assert ((trial.corners > 3) & (trial.corners < limit)).all()
