"""Why a device file did not open, in words with a way out."""

import errno
from collections.abc import Mapping

_REASONS: Mapping[int, str] = {
    errno.ENOENT: "absent",
    errno.ENODEV: "absent",
    errno.ENXIO: "absent",
    errno.EACCES: "forbidden",
    errno.EPERM: "forbidden",
    errno.EBUSY: "busy",
    errno.EAGAIN: "busy",
}


def why_not_opened(error: Exception, *, device: str, absent: str, group: str) -> str:
    """Return why a device did not open, with what to do.

    Args:
        error: what the system or a library over it raised.
        device: its name in the sentence.
        absent: what to say where there is no such device.
        group: whose members may open devices of the kind.
    """
    reason = _REASONS.get(error.errno or 0) if isinstance(error, OSError) else None
    match reason:
        case "absent":
            return absent
        case "forbidden":
            return (
                f"{device} may not be opened; add the user to the group {group} "
                f"(sudo usermod -aG {group} $USER) and log in again"
            )
        case "busy":
            return f"{device} is used by another program; close that program"
        case _:
            return f"{device} cannot be opened ({error}); check its name"
