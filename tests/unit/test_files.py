"""Folders that get a name of their own, whatever the clock says."""

from pathlib import Path

from rig.files import make_new_folder, unused


def test_a_folder_keeps_its_name_where_that_is_free(tmp_path: Path):
    assert make_new_folder(tmp_path / "sim" / "1_x", 0o750) == tmp_path / "sim" / "1_x"
    assert (tmp_path / "sim" / "1_x").stat().st_mode & 0o777 == 0o750


def test_folders_of_one_name_are_numbered_and_none_is_shared(tmp_path: Path):
    made = [make_new_folder(tmp_path / "1_x.y", 0o700) for _ in range(3)]
    assert [folder.name for folder in made] == ["1_x.y", "1_x.y-2", "1_x.y-3"]


def test_a_name_that_leads_nowhere_is_taken_too(tmp_path: Path):
    (tmp_path / "a").symlink_to(tmp_path / "gone")
    assert unused(tmp_path / "a") == tmp_path / "a-2"
