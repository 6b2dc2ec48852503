"""The one place that imports DepthAI, with its side effects switched off.

Importing the library starts threads, installs signal handlers, sends telemetry, and writes its log
to standard output, where results belong. Its environment variables are read once, at import, so
they are set here first; a value that the user has set stays.
"""

import os

from rig.errors import ConfigError

_QUIET = {
    "DEPTHAI_TELEMETRY": "0",
    "DEPTHAI_INSTALL_SIGNAL_HANDLER": "0",  # Ctrl-C and crashes stay ours
    "DEPTHAI_LEVEL": "off",  # the console log goes to stdout; devices log through a callback
    "DEPTHAI_SEARCH_TIMEOUT": "3000",  # ms; without it a missing device costs 11 s
    "DEPTHAI_DISABLE_STARTUP_NOTIFICATIONS": "1",
}
for _name, _value in _QUIET.items():
    os.environ.setdefault(_name, _value)

try:
    import depthai as dai
except ModuleNotFoundError as _error:
    if _error.name != "depthai":
        raise
    raise ConfigError(
        "asked for an OAK camera, depthai is not installed", advice="pip install 'epirig[oak]'"
    ) from _error

__all__ = ["dai"]
