"""Libraries that only some have: what to say where one is missing."""

from collections.abc import Generator
from contextlib import contextmanager

from rig.errors import ConfigError


@contextmanager
def robot_extra(extra: str, package: str, asked: str) -> Generator[None]:
    """Import a library inside this block.

    Args:
        extra: of rig, which brings it.
        package: that is imported.
        asked: what was asked for, for the message.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise ConfigError(
            f"asked for {asked}, {package} is not installed",
            advice=f"pip install 'epirig[{extra}]'",
        ) from error
