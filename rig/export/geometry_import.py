"""Another tool's calibration as that of a rig: its views, matched to the profile's."""

from collections.abc import Mapping

from rig.errors import FormatError
from rig.export.agreement import aligned
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile


def match_views(
    geometry: RigGeometry, profile: Profile, view_of: Mapping[str, str] | None = None
) -> RigGeometry:
    """Return the geometry in the order of the profile's views, seen from its reference.

    Args:
        geometry: as another tool's file told it.
        profile: the rig.
        view_of: by the file's name of a camera: the profile's name of that view.

    Raises:
        FormatError: the cameras of the file are not the views of the profile.
    """
    names = tuple(view.name for view in profile.views)
    renamed = dict(view_of or {})
    unknown = sorted(set(renamed) - set(geometry.names))
    if unknown:
        raise FormatError(
            f"--view names {', '.join(unknown)}, "
            f"the file's cameras are {', '.join(geometry.names)}",
            advice="name these",
        )
    called = tuple(renamed.get(name, name) for name in geometry.names)
    if sorted(called) != sorted(names):
        example = f"--view {geometry.names[0]}={names[0]}"
        raise FormatError(
            f"the file's cameras are {', '.join(called)}, the views of {profile.name} are "
            f"{', '.join(names)}",
            advice=f"say which is which, e.g. {example}",
        )
    relabelled = RigGeometry(
        called,
        geometry.reference,
        geometry.cameras,
        geometry.cam_from_reference,
        geometry.covariance,
        geometry.stage,
    )
    return aligned(relabelled, names, names[profile.reference])
