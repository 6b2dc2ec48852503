"""Frame folders: lossless, complete or absent, found by people and by the folder camera."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.database import Store, open_store
from rig.database.frames import sweep_folder
from rig.errors import StoreError
from rig.records import Sample
from rig.store.verify import verify
from tests.support.multiviews import VIEWS, noisy_multiview, same_multiview, ten_bit_multiview
from tests.support.stores import new_sweep, sqlite_url


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite_url(tmp_path)) as opened:
        yield opened


@pytest.fixture
def sample(store: Store) -> Sample:
    return store.add_sample(
        new_sweep(store), stop=1, number=0, reached_mm=1.0, multiview=noisy_multiview(0)
    )


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_frames_are_plain_lossless_png(store: Store, dtype: type[np.uint8 | np.uint16]) -> None:
    multiview = noisy_multiview(5, dtype=dtype, size_px=(33, 17))
    sample = store.add_sample(
        new_sweep(store), stop=0, number=0, reached_mm=1.0, multiview=multiview
    )
    assert same_multiview(store.load(sample), multiview)
    for frame in multiview.frames:
        seen = cv2.imread(str(sample.folder / f"{frame.view}.png"), cv2.IMREAD_UNCHANGED)
        assert seen is not None
        assert seen.dtype == dtype
        assert np.array_equal(seen, frame.image)


def test_bits_and_doubtful_times_come_back(store: Store) -> None:
    sample = store.add_sample(
        new_sweep(store), stop=0, number=0, reached_mm=1.0, multiview=ten_bit_multiview()
    )
    (stored,) = store.samples(sample.sweep_id)
    back = store.load(stored)
    assert same_multiview(back, ten_bit_multiview())
    assert back.frames[0].full_scale == 1023
    assert back.frames[0].began_s == ten_bit_multiview().frames[0].began_s


def test_folders_tell_a_person_what_is_in_them(store: Store, tmp_path: Path) -> None:
    sweep_id = new_sweep(store, rig="left-bench")
    sample = store.add_sample(
        sweep_id, stop=1, number=2, reached_mm=1.0, multiview=noisy_multiview(0)
    )
    started = f"{store.sweep(sweep_id).started_at:%Y%m%d-%H%M%S}"
    of_sweep = tmp_path / "frames" / "left-bench" / f"1_{started}"
    assert sample.folder == of_sweep / "stop_001_1234.6mm_forward" / "sample_02"
    assert sorted(path.name for path in sample.folder.iterdir()) == sorted(
        f"{view}.png" for view in VIEWS
    )


def test_a_sweep_begun_again_in_the_second_of_a_killed_one_has_a_folder_of_its_own(store: Store):
    # Killed before its row counted: the folder is there, and its number is given again.
    now = datetime.now(UTC)
    seconds = [now + timedelta(seconds=shift) for shift in range(-1, 60)]
    for second in seconds:
        (store.frames / sweep_folder("sim", 1, second)).mkdir(parents=True)
    folder = store.sweep(new_sweep(store, rig="sim")).folder
    assert folder.name in {f"{sweep_folder('sim', 1, second).name}-2" for second in seconds}
    assert {found.place.split("/")[1] for found in verify(store).litter} == {
        sweep_folder("sim", 1, second).name for second in seconds
    }


def test_a_pattern_replays_a_sweep_in_order(store: Store) -> None:
    sweep_id = new_sweep(store)
    for seed, (stop, number) in enumerate([(0, 0), (0, 1), (1, 0), (2, 0)]):
        store.add_sample(
            sweep_id, stop=stop, number=number, reached_mm=1.0, multiview=noisy_multiview(seed)
        )
    left = sorted(store.sweep(sweep_id).folder.glob("stop_*/sample_*/left.png"))
    assert [path.parent for path in left] == [sample.folder for sample in store.samples(sweep_id)]


def test_frames_move_with_the_database(store: Store, sample: Sample, tmp_path: Path) -> None:
    before = store.load(sample)
    store.close()
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for name in ("rig.sqlite", "frames"):
        (tmp_path / name).rename(moved / name)
    with open_store(sqlite_url(moved)) as again:
        (found,) = again.samples(sample.sweep_id)
        assert same_multiview(again.load(found), before)


def test_a_folder_without_a_row_gives_way(store: Store) -> None:
    """What a program leaves that is killed after the frames and before the row."""
    sweep_id = new_sweep(store)
    orphan = store.sweep(sweep_id).folder / "stop_001_1234.6mm_forward" / "sample_00"
    orphan.mkdir(parents=True)
    (orphan / "left.png").write_bytes(b"of another time")
    (orphan / "old.png").write_bytes(b"a view that is no more")
    sample = store.add_sample(
        sweep_id, stop=1, number=0, reached_mm=1.0, multiview=noisy_multiview(0)
    )
    assert sample.folder == orphan
    assert same_multiview(store.load(sample), noisy_multiview(0))
    assert not (orphan / "old.png").exists()


def test_half_written_frames_are_hidden_and_cleared_at_resume(store: Store) -> None:
    sweep_id = new_sweep(store)
    folder = store.sweep(sweep_id).folder
    half = folder / "stop_000_0400.0mm_forward" / ".sample_00.0a1b.tmp"
    half.mkdir(parents=True)
    (half / "left.png").write_bytes(b"")
    assert not list(folder.glob("stop_*/sample_*"))
    store.reopen_sweep(sweep_id)
    assert not half.exists()


def test_a_missing_image_is_named(store: Store, sample: Sample) -> None:
    image = sample.folder / "left.png"
    image.unlink()
    with pytest.raises(StoreError, match="asked for the image of view left, it is missing") as at:
        store.load(sample)
    assert str(image) in str(at.value)


@pytest.mark.parametrize("place", [0, 40, -1])
def test_a_damaged_image_is_not_used(store: Store, sample: Sample, place: int) -> None:
    image = sample.folder / "top.png"
    content = bytearray(image.read_bytes())
    content[place] ^= 1
    image.write_bytes(content)
    with pytest.raises(StoreError, match=r"top\.png: the image is damaged or was changed"):
        store.load(sample)


def test_a_shortened_or_exchanged_image_is_not_used(store: Store, sample: Sample) -> None:
    image = sample.folder / "top.png"
    whole = image.read_bytes()
    for other in (whole[: len(whole) // 2], b"", (sample.folder / "left.png").read_bytes()):
        image.write_bytes(other)
        with pytest.raises(StoreError, match=r"top\.png: the image is damaged or was changed"):
            store.load(sample)
