"""The page: one HTML file with its style and its scripts inside, and the policy that seals it."""

import base64
import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_FOLDER = Path(__file__).resolve().parent / "page"
_SCRIPTS = (
    "wire.js",
    "colours.js",
    "quality.js",
    "maps.js",
    "views.js",
    "epi.js",
    "profile.js",
    "cloud.js",
    "drift.js",
    "sweep.js",
    "calibrate.js",
    "link.js",
    "app.js",
)
"""In the order in which they are put together: each uses those before it."""


@dataclass(frozen=True, slots=True)
class Page:
    """What a browser gets."""

    html: bytes
    policy: str
    """Content security policy: nothing runs and nothing is asked for but what is inside."""


@cache
def page() -> Page:
    """Return the page, put together from its files."""
    style = _text("style.css")
    script = '"use strict";\n' + "".join(_text(name) for name in _SCRIPTS)
    html = _text("index.html").replace("/*style*/", style).replace("/*script*/", script)
    policy = (
        f"default-src 'none'; script-src {_digest(script)}; style-src {_digest(style)}; "
        "img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    )
    return Page(html.encode(), policy)


@cache
def icon() -> bytes:
    """Return the picture in the browser's tab, SVG."""
    return _text("icon.svg").encode()


def _text(name: str) -> str:
    return (_FOLDER / name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
