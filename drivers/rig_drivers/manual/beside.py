"""Two who may answer: the person at the terminal, and one who looks on elsewhere."""

from contextlib import suppress

from rig.devices import Bystander
from rig.errors import DeviceNotFoundError
from rig_drivers.manual.terminal import Person


class Beside:
    """Asks both; whoever answers first has answered. Keeps `Person`.

    Args:
        person: at the terminal; need not be there.
        bystander: at a page.
    """

    def __init__(self, person: Person, bystander: Bystander) -> None:
        self._person = person
        self._bystander = bystander
        self._has_terminal = True

    def greet(self) -> None:
        """See that somebody is at the terminal; the page alone is enough."""
        self._has_terminal = False
        with suppress(DeviceNotFoundError):
            self._person.greet()
            self._has_terminal = True

    def tell(self, text: str) -> None:
        """Show one line in both places."""
        self._person.tell(text)
        self._bystander.ask(text)

    def answer(self, timeout_s: float) -> str | None:
        """See `Person.answer`."""
        said = self._heard(timeout_s)
        if said is not None:
            self._bystander.settle()
        return said

    def _heard(self, timeout_s: float) -> str | None:
        if not self._has_terminal:
            return self._bystander.answer(timeout_s)
        typed = self._person.answer(timeout_s)
        return self._bystander.answer(0.0) if typed is None else typed
