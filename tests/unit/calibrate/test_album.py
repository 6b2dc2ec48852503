"""Pictures of a calibration on disk: there as they were taken, also after a crash."""

import json
from pathlib import Path

import pytest

from rig.calibrate.album import SOLVED, Album
from rig.calibrate.pictures import Picture
from rig.errors import ConfigError, StoreError
from rig.profile.load import load_profile
from tests.support.multiviews import noisy_multiview, same_multiview, ten_bit_multiview


def test_pictures_come_back_as_they_were_taken(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    taken = [Picture(n, noisy_multiview(seed=n), stage_mm=100.0 * n or None) for n in range(3)]
    for picture in taken:
        album.keep(picture)
    back = list(Album.unfinished(tmp_path, load_profile("sim")).pictures())
    assert [(p.number, p.stage_mm) for p in back] == [(0, None), (1, 100.0), (2, 200.0)]
    for one, other in zip(taken, back, strict=True):
        assert same_multiview(one.multiview, other.multiview)


def test_bits_and_doubtful_times_come_back(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    album.keep(Picture(0, ten_bit_multiview()))
    (back,) = album.pictures()
    assert same_multiview(back.multiview, ten_bit_multiview())
    assert back.multiview.frames[0].full_scale == 1023


def test_pictures_of_an_older_album_have_all_bits_and_no_doubt(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    album.keep(Picture(0, noisy_multiview(seed=0)))
    file = album.folder / "pictures.jsonl"
    line = json.loads(file.read_text())
    for frame in line["frames"]:
        del frame["bits"], frame["uncertainty_s"]
    file.write_text(json.dumps(line) + "\n")
    (back,) = album.pictures()
    assert same_multiview(back.multiview, noisy_multiview(seed=0))


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("{", "it is no JSON; take the line out"),
        ("{}", "number is missing, stage_mm is missing"),
        ('{"number": "one"}', "number: a whole number wanted, found 'one'"),
    ],
)
def test_a_line_that_was_changed_is_refused(tmp_path: Path, line: str, says: str):
    album = Album.new(tmp_path, load_profile("sim"))
    (album.folder / "pictures.jsonl").write_text(f"{line}\n")
    with pytest.raises(StoreError, match=f"line of pictures.jsonl is ill-formed: {says}"):
        list(album.pictures())


def test_a_line_cut_off_by_a_crash_costs_its_picture_only(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    for number in range(2):
        album.keep(Picture(number, noisy_multiview(seed=number)))
    file = album.folder / "pictures.jsonl"
    file.write_text(file.read_text()[:-20])
    assert [picture.number for picture in album.pictures()] == [0]
    album.keep(Picture(1, noisy_multiview(seed=9)))
    assert [picture.number for picture in album.pictures()] == [0, 1]


def test_a_damaged_picture_is_not_read_silently(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    album.keep(Picture(0, noisy_multiview(seed=1)))
    next(album.folder.glob("picture_000/*.png")).write_bytes(b"nothing")
    with pytest.raises(StoreError):
        list(album.pictures())


def test_only_an_unfinished_album_of_the_same_rig_is_resumed(tmp_path: Path):
    profile = load_profile("sim")
    with pytest.raises(ConfigError, match="none is unfinished"):
        Album.unfinished(tmp_path, profile)
    album = Album.new(tmp_path, profile)
    with pytest.raises(ConfigError, match="target of the profile has changed"):
        Album.unfinished(tmp_path, load_profile("sim", ("target.square_mm=30.0",)))
    album.write(SOLVED, "{}")
    with pytest.raises(ConfigError, match="none is unfinished"):
        Album.unfinished(tmp_path, profile)


def test_only_an_album_without_pictures_is_removed(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    assert album.is_empty
    assert album.lease == f"album sim/{album.folder.name}"
    album.discard_if_empty()
    assert not album.folder.exists()
    album.discard_if_empty()
    kept = Album.new(tmp_path, load_profile("sim"))
    kept.keep(Picture(0, noisy_multiview(seed=0)))
    kept.discard_if_empty()
    assert not kept.is_empty
    assert [picture.number for picture in kept.pictures()] == [0]


def test_an_album_that_went_away_is_not_made_anew(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    album.folder.rename(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="asked to write frames, the folder is gone"):
        album.keep(Picture(0, noisy_multiview(seed=0)))
    assert not album.folder.exists()


class _Killed(BaseException):
    pass


def test_what_is_killed_as_it_begins_is_no_album(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def killed(*_: object) -> None:
        raise _Killed

    monkeypatch.setattr("rig.calibrate.album.put_on_disk", killed)
    with pytest.raises(_Killed):
        Album.new(tmp_path, load_profile("sim"))
    (left,) = (tmp_path / "sim").iterdir()
    assert left.name.startswith(".calibration_")
    assert left.name.endswith(".tmp")  # which `rig store verify --repair` removes
    with pytest.raises(ConfigError, match="none is unfinished"):
        Album.unfinished(tmp_path, load_profile("sim"))


def test_a_folder_without_profile_and_pictures_does_not_hide_the_album_before(tmp_path: Path):
    album = Album.new(tmp_path, load_profile("sim"))
    (tmp_path / "sim" / "calibration_99990101-000000-000000").mkdir()
    assert Album.unfinished(tmp_path, load_profile("sim")).folder == album.folder
