"""Why a device file did not open, in words with a way out."""

import errno
from collections.abc import Mapping

from rig.errors import DeviceNotFoundError

_REASONS: Mapping[int, str] = {
    errno.ENOENT: "absent",
    errno.ENODEV: "absent",
    errno.ENXIO: "absent",
    errno.EACCES: "forbidden",
    errno.EPERM: "forbidden",
    errno.EBUSY: "busy",
    errno.EAGAIN: "busy",
}


def not_opened(
    error: Exception, name: str, *, what: str, absent: tuple[str, str], group: str
) -> DeviceNotFoundError:
    """Return the error of a device that did not open.

    Args:
        error: what the system or a library over it raised.
        name: of the device, for errors.
        what: stands for it in the sentence.
        absent: what was found where there is no such device, and what to do then.
        group: whose members may open devices of the kind.
    """
    reason = _REASONS.get(error.errno or 0) if isinstance(error, OSError) else None
    match reason:
        case "absent":
            found, advice = absent
        case "forbidden":
            found = f"{what} may not be opened"
            advice = (
                f"add the user to the group {group} (sudo usermod -aG {group} $USER) "
                "and log in again"
            )
        case "busy":
            found, advice = f"{what} is used by another program", "close that program"
        case _:
            found, advice = f"{what} cannot be opened ({error})", "check its name"
    return DeviceNotFoundError(name, found, advice=advice)
