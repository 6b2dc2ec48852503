"""Another tool's calibration as that of a rig: its views, matched to the profile's."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rig.errors import FormatError, StoreError
from rig.export.agreement import aligned
from rig.export.geometry_format import geometry_format
from rig.export.recognise import recognise
from rig.export.seen_from_one import seen_from_one
from rig.export.verdict import read_weakness
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile


@dataclass(frozen=True, slots=True)
class Foreign:
    """Another tool's calibration, as it was read."""

    source: str
    """Name of its format."""
    geometry: RigGeometry
    unit_mm: float | None
    """Of its lengths, as they were read; None where the file tells."""
    weak: str | None
    """Verdict that the file carries, of a calibration that was weak when it was exported."""


def read_foreign(path: Path, source: str | None = None) -> Foreign:
    """Read another tool's calibration.

    Args:
        path: file or folder.
        source: name of its format; None finds it by what the file holds.

    Raises:
        ConfigError: there is no such format of calibrations.
        FormatError: it is of no known format, or of another than was said, or damaged.
        StoreError: it cannot be read.
    """
    is_said = source is not None
    if source is None:
        known = recognise(path)
        source, path = known.source, known.path
    found = geometry_format(source)
    if found.path and path.is_dir():
        path = path / found.path
    try:
        geometry = found.read(path)
    except (FormatError, StoreError) as error:
        other = _recognised(path) if is_said else None
        if other is None or other == source:
            raise
        raise FormatError(
            f"{path}: asked to read it as {source}, found {other} ({error.found})",
            advice=f"give --format {other}, or leave --format out",
        ) from error
    return Foreign(found.name, geometry, found.unit_mm, read_weakness(path, found.comments))


def _recognised(path: Path) -> str | None:
    try:
        return recognise(path).source
    except (FormatError, StoreError):
        return None


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


def into_one_view(
    alone: RigGeometry,
    profile: Profile,
    view_of: Mapping[str, str] | None,
    others: RigGeometry | None,
) -> RigGeometry:
    """Return what is known of a rig, with another tool's camera for one of its views.

    Args:
        alone: one camera.
        profile: the rig.
        view_of: by the file's name of the camera: the profile's name of that view.
        others: the rig as it is calibrated; None where it is not.

    Returns:
        The geometry without a covariance: it belonged to the old camera.

    Raises:
        FormatError: it is not said which view it is, pictures have another size, or of the other
            views nothing is known.
    """
    (camera,), (name,) = alone.cameras, alone.names
    view = (view_of or {}).get(name, name)
    views = [known.name for known in profile.views]
    if view not in views:
        raise FormatError(
            f"the file holds one camera, {name}; the views of {profile.name} are "
            f"{', '.join(views)}",
            advice=f"say which it is, e.g. --view {name}={views[0]}; or give a folder with one "
            "file for each",
        )
    if others is None:
        raise FormatError(
            f"the file holds the camera of {view} only, and of the other views of {profile.name} "
            "nothing is known",
            advice="give a folder with one file for each view, or calibrate the rig before",
        )
    at = others.names.index(view)
    before = others.cameras[at]
    if (camera.width_px, camera.height_px) != (before.width_px, before.height_px):
        raise FormatError(
            f"the file's camera has pictures of {camera.width_px} x {camera.height_px} px, view "
            f"{view} is calibrated at {before.width_px} x {before.height_px} px",
            advice="calibrate the camera at that size, or the rig at the other",
        )
    cameras = (*others.cameras[:at], camera, *others.cameras[at + 1 :])
    return replace(others, cameras=cameras, covariance=None, stage=None)


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
