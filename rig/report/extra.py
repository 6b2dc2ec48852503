"""The extra `report`: what pages need beyond the core, and what to say where it is missing."""

from collections.abc import Generator
from contextlib import contextmanager

from rig.errors import ConfigError

_PACKAGES = ("matplotlib", "jinja2")


@contextmanager
def report_extra(asked: str, then: str) -> Generator[None]:
    """Import what draws pages inside this block.

    Args:
        asked: what was asked for, for the message.
        then: what to do once the extra is installed.

    Raises:
        ConfigError: the extra is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in _PACKAGES:
            raise
        raise ConfigError(
            f"asked for {asked}, {error.name} is not installed",
            advice=f"pip install 'epirig[report]', then {then}",
        ) from error
