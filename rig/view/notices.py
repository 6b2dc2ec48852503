"""What happens at the live page, one clear line each, and no flood of them."""

import time
from collections.abc import Callable

_AGAIN_S = 60.0
_MOST = 64


class Notices:
    """Tells each thing once, and again only after a minute.

    Args:
        tell: prints one line.
        clock_s: passes evenly.
    """

    def __init__(
        self, tell: Callable[[str], None], clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._tell = tell
        self._clock_s = clock_s
        self._told_s: dict[str, float] = {}

    def say(self, text: str) -> None:
        """Tell it, unless it was told within the last minute."""
        now_s = self._clock_s()
        if now_s - self._told_s.get(text, -_AGAIN_S) < _AGAIN_S:
            return
        if len(self._told_s) >= _MOST:  # whoever calls differently each time floods nothing either
            self._told_s = {t: s for t, s in self._told_s.items() if now_s - s < _AGAIN_S}
            if len(self._told_s) >= _MOST:
                return
        self._told_s[text] = now_s
        self._tell(f"view: {text}")
