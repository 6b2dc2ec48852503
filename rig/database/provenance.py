"""Which software made a result."""

import platform
from importlib.metadata import PackageNotFoundError, version

_DISTRIBUTIONS = (
    "epirig", "numpy", "opencv-python-headless", "numba", "scipy", "pyserial", "mitsuba",
)  # fmt: skip


def software_versions() -> dict[str, object]:
    """Return the versions of Python, rig and what it computes with; what is absent is left out."""
    versions: dict[str, object] = {
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
    for name in _DISTRIBUTIONS:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return versions
