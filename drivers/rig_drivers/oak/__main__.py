"""`python -m rig_drivers.oak [DEVICE]`: OAK devices, or the sensors of one, as one line of JSON.

It is the last line on stdout.

A process of its own: importing DepthAI starts threads, and a search that hangs can be ended.
"""

import json
import os
import sys
from dataclasses import asdict

from rig.errors import ConfigError, DeviceLostError, RigError


def main(device: str | None = None) -> None:
    """Print a list of devices, or of the sensors of one, or an object with the error.

    Args:
        device: id, address or host name; it is booted. None lists all devices.
    """
    try:
        answer: object = _devices() if device is None else _sensors(device)
    except RigError as error:
        answer = {
            "found": error.found,
            "advice": error.advice,
            "installed": not isinstance(error, ConfigError),
        }
    sys.stdout.write(json.dumps(answer) + "\n")


def _devices() -> list[dict[str, object]]:
    from rig_drivers.oak.discovery import found_oaks  # noqa: PLC0415 - the import itself may fail

    return [asdict(oak) for oak in found_oaks()]


def _sensors(name: str) -> list[dict[str, object]]:
    from rig_drivers.oak.described import described_sensors  # noqa: PLC0415 - as above
    from rig_drivers.oak.discovery import open_oak  # noqa: PLC0415

    device = open_oak(name)
    try:
        return [sensor.model_dump() for sensor in described_sensors(device)]
    except RuntimeError as error:
        raise DeviceLostError(
            f"OAK {name}", f"stopped answering ({error})", advice="plug it in again"
        ) from error
    finally:
        device.close()  # left booted, it would be busy for some seconds


if __name__ == "__main__":
    main(*sys.argv[1:2])
    sys.stdout.flush()
    # Taking DepthAI down takes longer than the search, and no device is open.
    os._exit(0)
