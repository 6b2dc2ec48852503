"""What is plugged in: every kind's own search, all at the same time."""

from importlib.resources import files

from rig.discovery import Findings, Search, search_all
from rig.profile.plugins import CAMERAS, STAGES


def find_devices(timeout_s: float) -> tuple[Findings, ...]:
    """List the devices of this machine, all searches at the same time.

    Args:
        timeout_s: longest wait for all of them together.
    """
    kinds = (*CAMERAS.kinds(), *STAGES.kinds())
    searches: dict[str, Search] = {}
    for kind in kinds:
        if kind.search is not None:  # one search serves all stages behind serial ports
            searches.setdefault(kind.search.kind, kind.search)
    return search_all(tuple(searches.values()), timeout_s)


def broken_plugins() -> tuple[str, ...]:
    """Return one line for every plug-in that cannot be used; it begins with its package."""
    return (*CAMERAS.problems(), *STAGES.problems())


def udev_rules() -> str:
    """Return the rules by which Linux lets its users open the devices that rig drives."""
    shipped = sorted(files("rig_drivers").joinpath("udev").iterdir(), key=lambda file: file.name)
    return "\n".join(file.read_text(encoding="utf-8") for file in shipped)
