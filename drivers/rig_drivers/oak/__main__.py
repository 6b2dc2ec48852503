"""`python -m rig_drivers.oak`: the OAK devices as one line of JSON, the last one on stdout.

A process of its own: importing DepthAI starts threads, and a search that hangs can be ended.
"""

import json
import os
import sys
from dataclasses import asdict

from rig.errors import ConfigError, RigError


def main() -> None:
    """Print a list of devices, or an object with the error."""
    try:
        from rig_drivers.oak.discovery import found_oaks  # noqa: PLC0415 - the import itself may fail

        answer: object = [asdict(oak) for oak in found_oaks()]
    except RigError as error:
        answer = {
            "found": error.found,
            "advice": error.advice,
            "installed": not isinstance(error, ConfigError),
        }
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Taking DepthAI down takes longer than the search, and no device is open.
    os._exit(0)
