"""Another tool's calibration as that of a rig: its views, matched to the profile's."""

from collections.abc import Mapping

from rig.errors import FormatError
from rig.export.agreement import aligned
from rig.export.common_frame import seen_from_one
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile


def match_views(
    geometry: RigGeometry, profile: Profile, view_of: Mapping[str, str] | None = None
) -> RigGeometry:
    """Return the geometry in the order of the profile's views, seen from its reference.

    Where `view_of` names every view of the profile, other cameras of the file are left behind.

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
    if sorted(renamed.values()) == sorted(names):
        geometry = _only(geometry, list(renamed))
    called = tuple(renamed.get(name, name) for name in geometry.names)
    if sorted(called) != sorted(names):
        example = f"--view {geometry.names[0]}={names[0]}"
        raise FormatError(
            f"the file's cameras are {', '.join(called)}, the views of {profile.name} are "
            f"{', '.join(names)}",
            advice=f"say which is which, e.g. {example}; with one --view per view of the profile "
            "other cameras are left out",
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


def _only(geometry: RigGeometry, chosen: list[str]) -> RigGeometry:
    """Some cameras of a geometry, as the first of them sees them."""
    if sorted(chosen) == sorted(geometry.names):
        return geometry
    at = [geometry.names.index(name) for name in chosen]
    return seen_from_one(
        chosen,
        [geometry.cameras[i] for i in at],
        [geometry.cam_from_reference[i] for i in at],
    )
