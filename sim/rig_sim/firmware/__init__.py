"""The other end of the wire: simulated stage firmware, so that the real drivers run in tests.

Every package here is named after the `kind` of stage whose controller it is, and its `make` gives
one from (settings, carriage, clock).
"""

from pkgutil import iter_modules


def protocols() -> tuple[str, ...]:
    """Return the kinds of stages whose controllers are simulated."""
    return tuple(sorted(module.name for module in iter_modules(__path__) if module.ispkg))
