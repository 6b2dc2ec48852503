"""Which of several rigs of one name: by the profile, else by the serial number of its camera."""

from collections.abc import Mapping

from rig.profile import Profile

_LASTING = "/by-id/"
"""Part of a device's path that holds its serial number; other paths change with the socket."""


def unit_of(profile: Profile, identity: Mapping[str, str]) -> str:
    """Return what tells this rig from another one of its name; empty where nothing does.

    Args:
        profile: of the rig.
        identity: what its open camera says of itself.
    """
    if profile.unit:
        return profile.unit
    if profile.camera.is_stored or profile.camera.is_simulated:
        return ""  # pictures do not tell which camera took them
    serial = identity.get("serial", "").strip()
    parts = [part.strip() for part in serial.split(",")]
    is_known = all(part and (not part.startswith("/") or _LASTING in part) for part in parts)
    return serial if is_known else ""
