"""The page is one file, sealed by its policy."""

import base64
import hashlib
import re

from rig.view.page_file import icon, page

MOST_BYTES = 150_000


def test_it_is_one_small_file_that_asks_for_nothing():
    html = page().html.decode()
    assert len(page().html) <= MOST_BYTES
    assert "/*style*/" not in html
    assert "/*script*/" not in html
    addresses = set(re.findall(r"""(?:https?:)?//[\w.]+\.\w+[^\s"']*""", html))
    assert addresses <= {"http://www.w3.org/2000/svg"}
    assert re.findall(r"<(?:link|script|img|iframe)[^>]+(?:src|href)=", html) == []


def test_the_policy_lets_only_what_is_inside_run():
    html = page().html.decode()
    for tag, directive in (("style", "style-src"), ("script", "script-src")):
        (text,) = re.findall(f"<{tag}>(.*?)</{tag}>", html, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{directive} 'sha256-{digest}';" in page().policy
    assert page().policy.startswith("default-src 'none';")
    assert "unsafe" not in page().policy


def test_the_icon_is_a_drawing():
    assert icon().startswith(b"<svg ")
