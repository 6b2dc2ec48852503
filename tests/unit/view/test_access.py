"""Who may look."""

import socket

import pytest

from rig.view.access import Access, Asked, Refused

ACCESS = Access("t0ken", "bench.example")
OWN = socket.gethostname()


@pytest.mark.parametrize(
    ("path", "place"),
    [("/t0ken/", ""), ("/t0ken", ""), ("/t0ken/live", "live"), ("/t0ken/?points=500", "")],
)
def test_the_token_opens(path: str, place: str):
    assert ACCESS.judge(path, "localhost:8000", None) == Asked(place)


@pytest.mark.parametrize(
    "path", ["/", "", "/t0ke/", "/t0kenn/", "/T0KEN/live", "/live", "//t0ken/", "/\xe9/", "/?t0ken"]
)
def test_without_it_nothing_is_given(path: str):
    refused = ACCESS.judge(path, "127.0.0.1:8000", None)
    assert isinstance(refused, Refused)
    assert refused.status == 403
    assert "token" in refused.reason


@pytest.mark.parametrize(
    "host",
    ["localhost", "LOCALHOST:1", "127.0.0.1:9", "[::1]:9", "192.168.1.7", "bench.example:80", OWN],
)
def test_this_machines_names_and_figures_are_ours(host: str):
    assert ACCESS.judge("/t0ken/", host, f"http://{host}") == Asked("")


@pytest.mark.parametrize("host", [None, "", "evil.example", "localhost.evil.example:80", "[::1"])
def test_a_foreign_name_is_refused_even_with_the_token(host: str | None):
    refused = ACCESS.judge("/t0ken/", host, None)
    assert isinstance(refused, Refused)
    assert refused.status == 421
    assert "not this machine's" in refused.reason


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://localhost:8001", "file://localhost:8000"]
)
def test_a_page_from_elsewhere_is_refused(origin: str):
    refused = ACCESS.judge("/t0ken/live", "localhost:8000", origin)
    assert isinstance(refused, Refused)
    assert refused.status == 403
    assert origin in refused.reason


def test_a_proxy_with_encryption_is_the_same_page():
    assert ACCESS.judge("/t0ken/live", "localhost", "https://LOCALHOST") == Asked("live")
