"""What all kinds of serial stages share: the search for ports, and the section of a new profile."""

import json
from pathlib import Path

from rig.discovery import FoundDevice, Search
from rig.profile.kinds import NewStage

_SECTION = """\
port = {port}{others}
travel_mm = [{near_mm}, {far_mm}]  # MEASURE: nearest and farthest distance of the board
distance_at_machine_zero_mm = {zero_mm}  # MEASURE: lens centre to board when the controller shows 0
direction = 1                # -1 if the controller counts towards the camera
speed_mm_s = 50.0
acceleration_mm_s2 = 200.0   # as in the controller; only for estimates of time
approach_mm = 2.0            # more than the play of the spindle: rig check measures it
may_move = false             # true when the lines above are MEASURED and the way is clear
"""


def serial_section(head: str, new: NewStage) -> str:
    """Return the section of a new profile.

    Args:
        head: what is different from protocol to protocol, up to the port.
        new: what is known of the stage.
    """
    port = new.devices[0] if new.devices else "/dev/serial/by-id/REPLACE-BY-YOURS"
    return head + _SECTION.format(
        port=json.dumps(port),
        others="".join(f"\n# also plugged in: {other}" for other in new.devices[1:]),
        near_mm=new.near_mm,
        far_mm=new.far_mm,
        zero_mm=new.far_mm + 3.0,
    )


def _find(_timeout_s: float) -> list[FoundDevice]:
    from rig_drivers.permission import why_not_permitted
    from rig_drivers.stage.serial_ports import list_serial_ports

    return [
        FoundDevice(
            port.name,
            port.description if port.description != "n/a" else "on the main board",
            tuple(name for name in (port.path, port.usb_serial) if name and name != port.name),
            why_not_permitted(Path(port.path)),
        )
        for port in list_serial_ports()
    ]


SERIAL_PORTS = Search("serial", "stage.port", _find, "serial ports")
"""The search of every kind of stage behind a serial port."""
