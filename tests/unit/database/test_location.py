"""Where things are stored."""

from pathlib import Path

import pytest

from rig.database.location import locate
from rig.errors import StoreError
from rig.places import user_data_dir


def test_by_default_everything_is_in_the_users_data(tmp_path: Path) -> None:
    found = locate(None, {"XDG_DATA_HOME": str(tmp_path)})
    assert found.file == tmp_path / "epirig" / "rig.sqlite"
    assert found.frames == tmp_path / "epirig" / "frames"


def test_the_option_goes_before_the_variable(tmp_path: Path) -> None:
    variable = {"RIG_DATABASE": f"sqlite:///{tmp_path}/variable/a.sqlite"}
    assert locate(None, variable).file == tmp_path / "variable" / "a.sqlite"
    assert locate(None, variable).frames == tmp_path / "variable" / "frames"
    option = f"sqlite:///{tmp_path}/option/b.sqlite"
    assert locate(option, variable).file == tmp_path / "option" / "b.sqlite"


def test_a_relative_file_is_shown_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = locate("sqlite:///b.sqlite?timeout=2", {})
    assert str(found) == f"sqlite:///{tmp_path}/b.sqlite?timeout=2"
    assert found.frames == tmp_path / "frames"


def test_frames_of_a_server_are_with_the_user_or_where_asked(tmp_path: Path) -> None:
    url = "postgresql+psycopg://me@bench.example/rig"
    home = {"XDG_DATA_HOME": str(tmp_path)}
    assert locate(url, home).frames == tmp_path / "epirig" / "frames"
    assert locate(url, home).file is None
    asked = {"RIG_FRAMES": str(tmp_path / "disk")}
    assert locate(url, home | asked).frames == tmp_path / "disk"
    assert locate(f"sqlite:///{tmp_path}/a.sqlite", asked).frames == tmp_path / "disk"


def test_a_password_is_never_shown() -> None:
    found = locate("postgresql+psycopg://me:geheim@bench.example/rig", {})
    assert "geheim" not in str(found)
    assert "bench.example" in str(found)
    assert found.url.password == "geheim"  # noqa: S105  (the test's own)


@pytest.mark.parametrize(
    "text", ["rig.sqlite", "me:geheim@bench", "postgresql://me:geheim@bench:port/rig"]
)
def test_what_is_no_url_is_refused_without_showing_it(text: str) -> None:
    with pytest.raises(StoreError, match="is no URL; for a file write sqlite:///") as refused:
        locate(text, {})
    assert "geheim" not in str(refused.value)


@pytest.mark.parametrize("text", ["sqlite://", "sqlite:///:memory:"])
def test_a_database_that_forgets_is_refused(text: str) -> None:
    with pytest.raises(StoreError, match="forgotten when the program ends"):
        locate(text, {})


def test_user_data_follow_the_customs_of_the_platform(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert user_data_dir("linux", {"XDG_DATA_HOME": "/data"}) == Path("/data")
    assert user_data_dir("linux", {"XDG_DATA_HOME": "not/absolute"}) == tmp_path / ".local/share"
    assert user_data_dir("linux", {}) == tmp_path / ".local/share"
    assert user_data_dir("darwin", {}) == tmp_path / "Library/Application Support"
    assert user_data_dir("win32", {"LOCALAPPDATA": "/local"}) == Path("/local")
    assert user_data_dir("win32", {}) == tmp_path / "AppData/Local"


@pytest.mark.parametrize("kind", ["postgresql", "postgresql+psycopg"])
def test_a_server_is_reached_by_the_driver_of_the_extra(kind: str) -> None:
    found = locate(f"{kind}://me@bench.example/rig", {})
    assert found.url.drivername == "postgresql+psycopg"
    assert found.is_server
    assert not locate("sqlite:///rig.sqlite", {}).is_server
