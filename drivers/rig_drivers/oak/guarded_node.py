"""Python code inside a pipeline: an exception that escaped into C++ would abort the process."""

import threading

from rig_drivers.oak.sdk import dai


class Failures:
    """What went wrong on threads where nobody can catch it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._texts: list[str] = []

    def add(self, text: str) -> None:
        """Note a failure; callable from any thread."""
        with self._lock:
            self._texts.append(text)

    def first(self) -> str | None:
        """Return the first failure, None while there is none."""
        with self._lock:
            return self._texts[0] if self._texts else None


class GuardedNode(dai.node.ThreadedHostNode):
    """A host node whose failure is noted instead of ending the process.

    Args:
        what: names the node in the note.
        failures: takes the note.
    """

    def __init__(self, what: str, failures: Failures) -> None:
        super().__init__()
        self._what = what
        self._failures = failures

    def run(self) -> None:
        """Work until the pipeline stops; called by it, on a thread of its own."""
        try:
            while self.isRunning():
                self.step()
        except BaseException as error:
            if self.isRunning():  # a queue that closes while the pipeline stops is no failure
                self._failures.add(f"{self._what} failed: {error!r}")

    def step(self) -> None:
        """Do one piece of work, in little time."""
        raise NotImplementedError
