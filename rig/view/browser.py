"""Open a browser where a person sits before this machine, and nowhere else."""

import os
import sys
import webbrowser
from collections.abc import Mapping


def has_display(environment: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Whether a window would be seen: a display, no remote shell, no automatic run."""
    if environment.get("CI") or environment.get("SSH_CONNECTION"):
        return False
    if platform in {"darwin", "win32"}:
        return True
    return bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def open_browser(url: str, environment: Mapping[str, str] = os.environ) -> bool:
    """Open the page, if somebody would see it; return whether a browser was told to."""
    if not has_display(environment):
        return False
    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
