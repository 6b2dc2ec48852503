"""A calibration whose program was ended between its row and its album is stored once."""

from pathlib import Path

from rig.calibrate.album import Album
from rig.calibrate.calibrate import _stored_before
from rig.file_modes import FileModes
from rig.profile.load import load_profile
from tests.support.kept_stores import kept_store

GEOMETRY = {"focal_px": 610.25, "places": [[0.0, 1.5], [2.0, 0.1 + 0.2]]}


def test_the_same_numbers_of_the_same_album_are_one_calibration(tmp_path: Path):
    profile = load_profile("sim", ("name=bench",))
    album, other = (Album(tmp_path / name, FileModes()) for name in ("one", "other"))
    with kept_store(tmp_path / "store") as store:
        number = store.save_calibration(
            rig="bench", geometry=GEOMETRY, quality={"folder": str(album.folder)}, profile={},
            versions={}, devices={}, temperature_degc=None, image_size_px=(4, 3),
        )  # fmt: skip
        again = {"places": [[0.0, 1.5], [2.0, 0.1 + 0.2]], "focal_px": 610.25}
        assert _stored_before(store, profile, album, again) == number
        assert _stored_before(store, profile, album, {**GEOMETRY, "focal_px": 610.26}) is None
        assert _stored_before(store, profile, other, GEOMETRY) is None
        another = profile.model_copy(update={"name": "desk"})
        assert _stored_before(store, another, album, GEOMETRY) is None
