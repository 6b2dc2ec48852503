"""A new profile as commented text: what is known is filled in, what must be measured says so."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from rig.errors import ConfigError
from rig.profile.sections import CAMERA, HEAD, STAGE, SWEEP

CameraKind = Literal["v4l2", "oak"]
StageKind = Literal["grbl", "zaber", "marlin"]

PLACES: dict[str, tuple[float, float]] = {
    "centre": (0.0, 0.0),
    "right": (0.93, 0.0),
    "bottom": (0.0, 1.08),
    "left": (-1.06, 0.0),
    "top": (0.0, -0.95),
}
"""Views in the order in which they are added; uneven on purpose."""
_SOCKETS = ("CAM_A", "CAM_B", "CAM_C", "CAM_D", "CAM_E")
_NEAR_MM, _FAR_MM = 400.0, 1200.0
_PITCH_MM = 60.0
_FOCAL_PER_WIDTH = 0.8
"""Focal length over picture width of a lens that sees some 64 degrees."""
_ROOM = 1.25
"""The search range of slopes is so much wider than a first guess."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a new profile describes."""

    name: str
    camera: CameraKind
    views: int
    """How many views, 2 to 5."""
    stage: StageKind | None
    cameras: tuple[str, ...] = ()
    """Names of the cameras that are plugged in: paths of V4L2 nodes, or the id of one OAK."""
    port: str | None = None
    """Port of the stage, where one is plugged in."""
    other_ports: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
    """Lines for the head of the file."""


def profile_text(recipe: Recipe) -> str:
    """Return a profile as TOML with comments; it loads as it is.

    Raises:
        ConfigError: a number of views that no arrangement is known for.
    """
    if not 2 <= recipe.views <= len(PLACES):
        raise ConfigError(
            f"asked for {recipe.views} views, a new profile has 2 to {len(PLACES)}",
            advice="write further [[views]] by hand",
        )
    names = list(PLACES)[: recipe.views]
    width_px, height_px = 1280, 800
    slope_px = _PITCH_MM * _FOCAL_PER_WIDTH * width_px
    parts = [
        HEAD.format(
            name=recipe.name,
            description=_description(recipe),
            notes="".join(f"# {note}\n" for note in recipe.notes),
            pitch_mm=_PITCH_MM,
        ),
        *(_view(name) for name in names),
        CAMERA[recipe.camera].format(
            width_px=width_px,
            height_px=height_px,
            devices=_devices(recipe, names),
            device=json.dumps(recipe.cameras[0] if recipe.cameras else ""),
        ),
    ]
    if recipe.stage is not None:
        parts.append(
            STAGE[recipe.stage].format(
                port=json.dumps(recipe.port or "/dev/serial/by-id/REPLACE-BY-YOURS"),
                others="".join(f"\n# also plugged in: {port}" for port in recipe.other_ports),
                near_mm=_NEAR_MM,
                far_mm=_FAR_MM,
                zero_mm=_FAR_MM + 3.0,
            )
        )
    low_px, high_px = slope_px / _FAR_MM / _ROOM, slope_px / _NEAR_MM * _ROOM
    parts.append(
        SWEEP.format(near_mm=_NEAR_MM, far_mm=_FAR_MM, low_px=round(low_px), high_px=round(high_px))
    )
    return "\n".join(parts)


def _description(recipe: Recipe) -> str:
    camera = "V4L2 cameras" if recipe.camera == "v4l2" else "OAK sensors"
    stage = "no stage" if recipe.stage is None else f"{recipe.stage} stage"
    return f"{recipe.views} {camera}, {stage}"


def _view(name: str) -> str:
    x_steps, y_steps = PLACES[name]
    comment = " # the reference: depth counts from its optical centre" if name == "centre" else ""
    return f'[[views]]\nname = "{name}"{comment}\nx_steps = {x_steps}\ny_steps = {y_steps}\n'


def _devices(recipe: Recipe, names: Sequence[str]) -> str:
    if recipe.camera == "oak":
        return "\n".join(f'{n} = "{s}"' for n, s in zip(names, _SOCKETS, strict=False))
    lines: list[str] = []
    for place, name in enumerate(names):
        if place < len(recipe.cameras):
            lines.append(f"{name} = {json.dumps(recipe.cameras[place])}")
        else:
            lines.append(f'{name} = "/dev/v4l/by-path/REPLACE-BY-YOURS-{name}"')
    spare = recipe.cameras[len(names) :]
    return "\n".join([*lines, *(f"# also plugged in: {path}" for path in spare)])
