"""A browser opens only where somebody sits."""

import webbrowser

import pytest

from rig.view import browser


@pytest.mark.parametrize(
    ("environment", "platform", "seen"),
    [
        ({}, "linux", False),
        ({"DISPLAY": ":0"}, "linux", True),
        ({"WAYLAND_DISPLAY": "wayland-0"}, "linux", True),
        ({"DISPLAY": ":0", "CI": "true"}, "linux", False),
        ({"DISPLAY": ":10", "SSH_CONNECTION": "10.0.0.1 1 10.0.0.2 22"}, "linux", False),
        ({}, "darwin", True),
        ({"CI": "1"}, "win32", False),
    ],
)
def test_a_display_is_what_it_takes(environment: dict[str, str], platform: str, seen: bool):
    assert browser.has_display(environment, platform) is seen


def test_it_is_given_the_address_once(monkeypatch: pytest.MonkeyPatch):
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) or True)
    monkeypatch.setattr(browser.sys, "platform", "linux")
    assert browser.open_browser("http://a/", {"DISPLAY": ":0"})
    assert not browser.open_browser("http://b/", {})
    assert opened == ["http://a/"]


def test_a_machine_without_a_browser_is_no_error(monkeypatch: pytest.MonkeyPatch):
    def fail(_url: str) -> bool:
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr(webbrowser, "open", fail)
    assert browser.open_browser("http://a/", {"DISPLAY": ":0"}) is False
