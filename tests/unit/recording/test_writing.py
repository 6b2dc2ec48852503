"""What can go wrong while a recording is written, and what it costs."""

import gc
import os
import resource
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from rig.errors import StoreError
from rig.frames import Frame, MultiView
from rig.recording import RecordingWriter, recorded
from tests.support.recordings import VIEWS, taken, time_ns

OURS = tracemalloc.Filter(inclusive=True, filename_pattern="*/rig/recording/*")


@pytest.mark.slow
def test_memory_stays_flat_and_the_index_is_whole(tmp_path: Path):
    path, many = tmp_path / "r.mcap", 800
    image = np.zeros((4, 4), np.uint8)
    multiview = MultiView(tuple(Frame(view, image, 1.0, 1) for view in VIEWS))
    kept: list[int] = []
    tracemalloc.start()
    try:
        with RecordingWriter(path, VIEWS, {}) as writer:
            for number in range(many):
                writer.write(multiview, number)
                if number in (300, many - 1):
                    gc.collect()
                    taken_now = tracemalloc.take_snapshot().filter_traces([OURS])
                    kept.append(sum(entry.size for entry in taken_now.statistics("filename")))
    finally:
        tracemalloc.stop()
    # An index in memory would keep some hundred bytes each; a library keeps some of its objects.
    assert abs(kept[1] - kept[0]) < 50 * 500, f"{kept} bytes after 300 and {many} multi-views"
    with path.open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
    assert summary is not None
    assert [index.message_start_time for index in summary.chunk_indexes] == list(range(many))


def test_a_full_disk_keeps_what_was_written_before(tmp_path: Path):
    path, limits = tmp_path / "r.mcap", resource.getrlimit(resource.RLIMIT_FSIZE)
    writer = RecordingWriter(path, VIEWS, {})
    for number in range(3):
        writer.write(taken(number), time_ns(number))
    size = path.stat().st_size
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 300, limits[1]))
    try:
        with pytest.raises(StoreError, match=r"cannot be written: .*; is the disk full"):
            writer.write(taken(3), time_ns(3))
        assert path.stat().st_size == size
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    writer.write(taken(4), time_ns(4))
    writer.close()
    writer.close()
    assert [found.time_ns for found in recorded(path)] == [time_ns(n) for n in (0, 1, 2, 4)]
    with path.open("rb") as file:
        assert len(list(make_reader(file, validate_crcs=True).iter_messages())) == 12


def test_a_disk_that_is_full_from_the_start_leaves_no_file(tmp_path: Path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
    try:
        with pytest.raises(StoreError, match="the disk is full"):
            RecordingWriter(tmp_path / "r.mcap", VIEWS, {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(tmp_path.iterdir())


def test_an_index_that_finds_no_room_is_told_and_the_multiviews_stay(tmp_path: Path):
    path, limits = tmp_path / "r.mcap", resource.getrlimit(resource.RLIMIT_FSIZE)
    writer = RecordingWriter(path, VIEWS, {})
    writer.write(taken(0), time_ns(0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 50, limits[1]))
    try:
        with pytest.raises(StoreError, match="cannot be written"):
            writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [found.time_ns for found in recorded(path)] == [time_ns(0)]


def test_every_multiview_is_in_the_file_once_it_is_written(tmp_path: Path):
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, VIEWS, {}) as writer:
        for number in range(4):
            writer.write(taken(number), time_ns(number))
            assert [found.time_ns for found in recorded(path)] == [
                time_ns(n) for n in range(number + 1)
            ]


@pytest.mark.parametrize("lost", [1, 40, 700])
def test_a_killed_writer_loses_the_unfinished_multiview_alone(tmp_path: Path, lost: int):
    path = tmp_path / "r.mcap"
    writer = RecordingWriter(path, VIEWS, {})
    for number in range(3):
        writer.write(taken(number), time_ns(number))
    size = path.stat().st_size
    writer.write(taken(3), time_ns(3))
    # Cut behind the chunk before: as if the last call had been stopped in its middle.
    os.truncate(path, size + lost)
    assert [found.time_ns for found in recorded(path)] == [time_ns(n) for n in range(3)]
    writer.close()
