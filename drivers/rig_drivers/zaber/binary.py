"""Who speaks Zaber's binary protocol instead of the ASCII one: the way to say what to change.

Source: Zaber binary protocol manual: six bytes each way, device, command and a number of four
bytes; command 50 asks every device for its kind.
"""

from collections.abc import Sequence

from rig_drivers.stage.serial_line import SerialLine

BINARY_BAUD = 9600
ANSWER_TIMEOUT_S = 0.5
MESSAGE_BYTES = 6
WHO = 50
REFUSED = 255
ALL = 0


def binary_devices(line: SerialLine) -> Sequence[int]:
    """Ask in the binary protocol who is there; leaves the line at its own speed.

    Returns:
        The numbers of the devices that answered.

    Raises:
        DeviceLostError: the port is gone.
    """
    question = bytes((ALL, WHO, 0, 0, 0, 0))
    return read_devices(line.probe(question, baud=BINARY_BAUD, timeout_s=ANSWER_TIMEOUT_S))


def read_devices(data: bytes) -> Sequence[int]:
    """Return the numbers of the devices that said this; nothing if it is not their protocol."""
    messages = [data[at : at + MESSAGE_BYTES] for at in range(0, len(data), MESSAGE_BYTES)]
    if any(len(one) != MESSAGE_BYTES or one[1] not in {WHO, REFUSED} for one in messages):
        return ()
    return sorted({one[0] for one in messages if one[0] != ALL})
