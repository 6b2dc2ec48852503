"""Passwords are hidden wherever they stand, and what steers a terminal is spelled."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import make_url

from rig.database import open_store
from rig.database.location import locate
from rig.database.provenance import software_versions, this_program
from rig.report.page import flat_fields
from rig.secrets import (
    is_secret,
    value_without_secrets,
    without_secrets,
    words_without_secrets,
)
from rig.terminal_text import harmless, harmless_json, one_line
from tests.support.command import Command
from tests.support.stores import new_sweep


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("postgresql://u:geheim@h/db", "postgresql://u:***@h/db"),
        ("postgresql://u:ge@heim@h/db", "postgresql://u:***@h/db"),
        ("at rtsp://u:geheim@cam:554/x now", "at rtsp://u:***@cam:554/x now"),
        ("postgresql://h/db?sslpassword=geheim&a=1", "postgresql://h/db?sslpassword=***&a=1"),
        ("x?user=u&password=geheim", "x?user=u&password=***"),
        ("--set camera.password=geheim", "--set camera.password=***"),
        ("PGPASSWORD=geheim rig", "PGPASSWORD=*** rig"),
        ("api-key: 'ge heim' was refused", "api-key: *** was refused"),
        ('{"token": "geheim"}', '{"token": ***}'),
        ("sqlite:////data/a@b/rig.sqlite", "sqlite:////data/a@b/rig.sqlite"),
        ("compass=12 tokens=3 passes: 4", "compass=12 tokens=3 passes: 4"),
        ("http://127.0.0.1:8765/", "http://127.0.0.1:8765/"),
    ],
)
def test_passwords_in_any_part_of_a_text_are_hidden(text: str, shown: str):
    assert without_secrets(text) == shown


@given(st.text(st.characters(exclude_categories=("Z", "C")), min_size=3))
def test_no_password_of_a_url_survives(password: str):
    secret = f"#{password}#"
    assert secret not in without_secrets(f"postgresql://user:{secret}@host/db")


def test_words_behind_an_option_that_names_a_secret_are_hidden():
    words = ["sweep", "--password", "geheim", "--db=postgresql://u:geheim@h/x", "--token=geheim"]
    shown = words_without_secrets([*words, "--note", "kept"])
    assert shown == [
        *("sweep", "--password", "***", "--db=postgresql://u:***@h/x"),
        *("--token=***", "--note", "kept"),
    ]


def test_profiles_are_shown_without_secrets():
    profile = {"camera": {"password": "geheim", "url": "rtsp://u:geheim@h", "pins": [1, "a"]}}
    assert value_without_secrets(profile) == {
        "camera": {"password": "***", "url": "rtsp://u:***@h", "pins": [1, "a"]}
    }
    assert dict(flat_fields(profile)) == {
        "camera.password": "***", "camera.url": "rtsp://u:***@h", "camera.pins": "[1, 'a']",
    }  # fmt: skip
    assert value_without_secrets({"password": ""}) == {"password": ""}
    assert is_secret("camera.api_key")
    assert not is_secret("passfile")


@pytest.mark.parametrize(
    ("url", "shown", "password"),
    [
        ("postgresql://u:a@b@host/db", "postgresql+psycopg://u:***@host/db", "a@b"),
        ("postgresql://u:a@b@c@/db?host=/x", "postgresql+psycopg://u:***@/db?host=%2Fx", "a@b@c"),
        ("postgresql://u@h/db?password=x", "postgresql+psycopg://u@h/db?password=***", None),
        ("postgresql://u@h/db?sslpassword=x", "postgresql+psycopg://u@h/db?sslpassword=***", None),
    ],
)
def test_an_address_is_shown_without_passwords_and_means_what_it_says(
    url: str, shown: str, password: str | None
):
    location = locate(url, {})
    assert (str(location), location.url.password) == (shown, password)
    assert location.url.host in ("host", "", "h", None)
    assert make_url(shown).database == "db"


def test_who_ran_what_is_known_without_secrets(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("sys.argv", ["/opt/rig/__main__.py", "sweep", "sim", "--password", "x y"])
    monkeypatch.setattr("getpass.getuser", lambda: "ada")
    monkeypatch.setattr("platform.node", lambda: "bench-1")
    made = this_program(("night",))
    assert (made.user, made.host, made.tags) == ("ada", "bench-1", ("night",))
    assert made.command == "rig sweep sim --password '***'"

    def nobody() -> str:
        raise OSError

    monkeypatch.setattr("getpass.getuser", nobody)
    assert this_program().user == "unknown"
    versions = software_versions()
    assert {"python", "platform", "epirig", "numpy", "pydantic", "alembic"} <= set(versions)
    assert "ruff" not in versions


@given(st.text())
def test_no_letter_steers_a_terminal(text: str):
    shown = harmless(text)
    assert all(letter.isprintable() or letter in "\n\t" or letter.isspace() for letter in shown
               if letter < "\xa0")  # fmt: skip
    shown.encode()
    assert json.loads(harmless_json(json.dumps(text, ensure_ascii=False))) == text


def test_what_is_spelled_can_still_be_read():
    assert harmless("a\x1b[2Jb\x9b1m\u202ec\r\n\td") == "a\\x1b[2Jb\\x9b1m\\u202ec\\r\n\td"
    assert harmless("äöü 深度 ±") == "äöü 深度 ±"
    assert one_line("a\n b\x07") == "a b\\x07"
    assert harmless_json('"\x9b"') == '"\\u009b"'


def test_stored_texts_do_not_steer_the_terminal_of_history(rig: Command, tmp_path: Path):
    with open_store(f"sqlite:///{tmp_path}/bench/rig.sqlite") as store:
        store.create_sweep(
            rig="be\x1b]0;owned\x07nch", profile={}, stops=(), samples_per_stop=1, versions={},
            devices={}, note="\x9b31m\nred\u202e", unit="A\x1b[1m",
        )  # fmt: skip
        new_sweep(store)
    shown, as_json = rig("history").out, rig("history", "--json").out
    for text in (shown, as_json):
        assert not set(text) & set("\x1b\x07\x9b\u202e")
    assert "be\\x1b]0;owned\\x07nch" in shown
    assert "\\x9b31m red\\u202e" in shown
    assert json.loads(as_json)["sweeps"][0]["note"] == "\x9b31m\nred\u202e"


def test_an_error_shows_no_password(rig: Command, tmp_path: Path):
    answer = rig("history", "--db", f"sqlite:///{tmp_path}/none.sqlite?password=geheim")
    assert answer.code == 1
    assert "geheim" not in answer.err
    assert "password=***" in answer.err
