"""From what is plugged in to the recipe of a new profile; what is not clear is asked."""

from collections.abc import Mapping, Sequence

from rig.discovery import Findings, FoundDevice
from rig.errors import ConfigError, RigError
from rig.profile.kinds import CameraTemplate, ToldViews
from rig.profile.parts import places_of
from rig.profile.plugins import CAMERAS, STAGES
from rig.profile.template import (
    PLACES,
    Recipe,
    camera_template,
    new_cameras,
    new_stages,
    stage_template,
)

_ByKind = Mapping[str, Sequence[FoundDevice]]
"""What every search found, by its name."""


ASK_S = 30.0
"""Longest wait for a device that must boot before it can tell what it has."""


def told_views(
    findings: Sequence[Findings], *, camera: str | None
) -> tuple[ToldViews | None, tuple[str, ...]]:
    """Ask the camera that a new profile would describe which views it has.

    Args:
        findings: what is plugged in.
        camera: kind of camera; None takes the one that is plugged in.

    Returns:
        What it told, None where no device of the kind can tell; and lines for the head of the
        profile, where one could not be asked.

    Raises:
        ConfigError: see `recipe_for`.
    """
    by_kind = {found.kind: found.devices for found in findings}
    kind = camera or _camera_kind(by_kind)
    ask, plugged = camera_template(kind).ask, _cameras(by_kind, kind)
    if ask is None or not plugged or plugged[0].problem is not None:
        return None, ()
    try:
        return ask(plugged[0].name, ASK_S), ()
    except RigError as error:
        note = f"{plugged[0].name} did not tell which sensors it has, so they are guessed: {error}"
        return None, (" ".join(note.split()),)


def recipe_for(
    name: str,
    findings: Sequence[Findings],
    *,
    camera: str | None,
    views: int | None,
    stage: str | None,
    has_stage: bool = True,
    layout: str | None = None,
    told: ToldViews | None = None,
    notes: Sequence[str] = (),
) -> Recipe:
    """Decide what a new profile describes.

    Args:
        name: of the rig.
        findings: what is plugged in.
        camera: kind of camera; None takes the one that is plugged in.
        views: how many; None takes what the kind has (an OAK's pair), or as many as are plugged in.
        stage: kind of stage; None takes it from the name of the adapter, else the likeliest.
        has_stage: whether there is one at all.
        layout: how all views lie in the picture of one device; None where each has its own.
        told: what the camera has told of its views; None where it was not asked.
        notes: further lines for the head of the file.

    Raises:
        ConfigError: nothing is plugged in and nothing was said, or cameras of several kinds are.
    """
    by_kind = {found.kind: found.devices for found in findings}
    kind = camera or _camera_kind(by_kind)
    plugged = _cameras(by_kind, kind)
    cameras = tuple(device.name for device in plugged)
    if told is not None:
        count = len(told.sensors)
    else:
        guess = places_of(layout) if layout and not views else 0
        count = views or guess or _views(camera_template(kind), plugged)
    # One camera alone is calibrated by a board in the hand, unless somebody says otherwise.
    is_alone = told is not None and count == 1 and stage is None
    stage_kind = (stage or _stage_kind(by_kind)) if has_stage and not is_alone else None
    return Recipe(
        name=name,
        camera=kind,
        views=count,
        stage=stage_kind,
        cameras=cameras,
        stages=() if stage_kind is None else tuple(d.name for d in _stages(by_kind, stage_kind)),
        notes=(*notes, *_notes(findings), *(() if layout else _offers(plugged))),
        layout=layout,
        told=told,
        picture=plugged[0].picture if plugged else None,
    )


def _cameras(by_kind: _ByKind, kind: str) -> Sequence[FoundDevice]:
    search = CAMERAS.kind(kind).search
    return () if search is None else by_kind.get(search.kind, ())


def _stages(by_kind: _ByKind, kind: str) -> Sequence[FoundDevice]:
    search = STAGES.kind(kind).search
    found = () if search is None else by_kind.get(search.kind, ())
    return [device for device in found if _may_be_a_stage(device)]


def _camera_kind(by_kind: _ByKind) -> str:
    kinds = [kind for kind in new_cameras() if _cameras(by_kind, kind)]
    if len(kinds) == 1:
        return kinds[0]
    if kinds:
        titles = " and ".join(camera_template(kind).title for kind in kinds)
        options = " or ".join(f"--camera {kind}" for kind in kinds)
        raise ConfigError(
            f"asked for a new profile, found {titles}", advice=f"say which: {options}"
        )
    raise ConfigError(
        "asked for a new profile from what is plugged in, found no camera",
        advice="say what it will be "
        "(--camera v4l2 --views 2, --camera oak), or begin with a simulated rig (--from sim)",
    )


def _views(template: CameraTemplate, cameras: Sequence[FoundDevice]) -> int:
    if template.views is not None:
        return template.views
    if len(cameras) < 2:
        offers = "".join(f"; {offer}" for offer in _offers(cameras))
        raise ConfigError(
            f"a rig has two views or more, found {len(cameras)} {template.title}",
            advice="plug the others in, or say how many there will be: --views 2, or --views 1 to "
            f"calibrate one camera alone{offers}",
        )
    return min(len(cameras), len(PLACES))


def _offers(cameras: Sequence[FoundDevice]) -> list[str]:
    """Say which devices may give several views in one picture: a guess that nobody acts on."""
    return [
        f"{camera.name}: its pictures have the shape of {places_of(camera.layout)} views; if so, "
        f"write a profile with --layout {camera.layout}"
        for camera in cameras
        if camera.layout is not None
    ]


def _stage_kind(by_kind: _ByKind) -> str:
    kinds = new_stages()
    for kind in kinds:
        adapter, found = stage_template(kind).adapter, _stages(by_kind, kind)
        if adapter is not None and found and adapter in found[0].description.lower():
            return kind
    return kinds[0]


def _may_be_a_stage(device: FoundDevice) -> bool:
    """USB adapters and boards; a port on the main board mostly has nothing at its end."""
    return not device.name.startswith("/dev/ttyS")


def _notes(findings: Sequence[Findings]) -> list[str]:
    """What stands in the way today, for the head of the file."""
    return [
        f"{device.name}: {device.problem}"
        for found in findings
        for device in found.devices
        if device.problem is not None and _may_be_a_stage(device)
    ]
