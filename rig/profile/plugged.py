"""From what is plugged in to the recipe of a new profile; what is not clear is asked."""

from collections.abc import Mapping, Sequence

from rig.discovery import Findings, FoundDevice
from rig.errors import ConfigError
from rig.profile.template import PLACES, CameraKind, Recipe, StageKind

_OAK_VIEWS = 2


def recipe_for(
    name: str,
    findings: Sequence[Findings],
    *,
    camera: CameraKind | None,
    views: int | None,
    stage: StageKind | None,
    has_stage: bool = True,
) -> Recipe:
    """Decide what a new profile describes.

    Args:
        name: of the rig.
        findings: what is plugged in.
        camera: kind of camera; None takes the one that is plugged in.
        views: how many; None takes as many as V4L2 cameras are plugged in, or an OAK's pair.
        stage: protocol of the stage; None takes it from the name of the adapter, else GRBL.
        has_stage: whether there is one at all.

    Raises:
        ConfigError: nothing is plugged in and nothing was said, or both kinds of camera are.
    """
    by_kind = {found.kind: found.devices for found in findings}
    kind = camera or _camera_kind(by_kind)
    cameras = tuple(device.name for device in by_kind.get(kind, ()))
    ports = [device for device in by_kind.get("serial", ()) if _may_be_a_stage(device)]
    return Recipe(
        name=name,
        camera=kind,
        views=_views(kind, cameras) if views is None else views,
        stage=(stage or _stage_kind(ports)) if has_stage else None,
        cameras=cameras,
        port=ports[0].name if ports else None,
        other_ports=tuple(port.name for port in ports[1:]),
        notes=tuple(_notes(findings)),
    )


def _camera_kind(by_kind: Mapping[str, Sequence[FoundDevice]]) -> CameraKind:
    kinds: list[CameraKind] = [kind for kind in ("oak", "v4l2") if by_kind.get(kind)]
    if len(kinds) == 1:
        return kinds[0]
    if kinds:
        raise ConfigError(
            "asked for a new profile, found OAK and V4L2 cameras",
            advice="say which: --camera oak or --camera v4l2",
        )
    raise ConfigError(
        "asked for a new profile from what is plugged in, found no camera",
        advice="say what it will be "
        "(--camera v4l2 --views 2, --camera oak), or begin with a simulated rig (--from sim)",
    )


def _views(kind: CameraKind, cameras: Sequence[str]) -> int:
    if kind == "oak":
        return _OAK_VIEWS
    if len(cameras) < 2:
        raise ConfigError(
            f"a rig has two views or more, found {len(cameras)} V4L2 cameras",
            advice="plug the others in, or say how many there will be: --views 2",
        )
    return min(len(cameras), len(PLACES))


def _may_be_a_stage(device: FoundDevice) -> bool:
    """USB adapters and boards; a port on the main board mostly has nothing at its end."""
    return not device.name.startswith("/dev/ttyS")


def _stage_kind(ports: Sequence[FoundDevice]) -> StageKind:
    if ports and "zaber" in ports[0].description.lower():
        return "zaber"
    return "grbl"


def _notes(findings: Sequence[Findings]) -> list[str]:
    """What stands in the way today, for the head of the file."""
    return [
        f"{device.name}: {device.problem}"
        for found in findings
        for device in found.devices
        if device.problem is not None and (found.kind != "serial" or _may_be_a_stage(device))
    ]
