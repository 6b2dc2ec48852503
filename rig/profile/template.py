"""A new profile as commented text: what is known is filled in, what must be measured says so."""

from dataclasses import dataclass, field

from rig.discovery import FoundPicture
from rig.errors import ConfigError
from rig.profile.kinds import (
    BuiltIn,
    CameraTemplate,
    NewCamera,
    NewStage,
    StageTemplate,
    ToldSensor,
    ToldViews,
)
from rig.profile.parts import layouts, places_of
from rig.profile.plugins import CAMERAS, STAGES
from rig.profile.targets import TargetConfig
from rig.profile.toml_text import section_text

PLACES: dict[str, tuple[float, float]] = {
    "centre": (0.0, 0.0),
    "right": (0.93, 0.0),
    "bottom": (0.0, 1.08),
    "left": (-1.06, 0.0),
    "top": (0.0, -0.95),
}
"""Views in the order in which they are added; uneven on purpose."""
_NEAR_MM, _FAR_MM = 400.0, 1200.0
_PITCH_MM = 60.0
_FOCAL_PER_WIDTH = 0.8
"""Focal length over picture width of a lens that sees some 64 degrees."""
_ROOM = 1.25
"""The search range of slopes is so much wider than a first guess."""


@dataclass(frozen=True, slots=True)
class _Words:
    """What is said otherwise of places that must be measured and of those that a device knows."""

    next: str
    pitch: str
    places: str
    slopes: str
    """Ends inside `[quality]`."""


_HEAD = """\
# {description}. Written by `rig profile new`; lines that say MEASURE hold guesses.
# Next: {next}.
{notes}name = "{name}"
description = "{description}"

# One view step, mm: the distance that x_steps and y_steps below are multiples of. {pitch_note}
pitch_mm = {pitch_mm}

{places_note}
"""
_MEASURED = _Words(
    "rig check {name} --no-move, then rig check {name}, then rig sweep {name}",
    "MEASURE it once,\n# between two lens centres; a calibration finds the rest.",
    "# Where each lens centre is, in view steps right of and below the reference. MEASURE. Uneven "
    "spacing\n# is an advantage: a repeating pattern then cannot look right at a wrong distance.",
    """\
# Slopes that the scene can have, px per view step: pitch_mm * focal_px / distance for cameras that
# look straight ahead, less the same at the focus distance for others. Narrow is faster and safer.
[slopes]
range_px = [{low_px}, {high_px}]

# A run that misses one of these ends with exit code 3. Without a geometric calibration be generous.
[quality]
""",
)
_BUILT_IN = _Words(
    "rig capture {name}; rig calibrate {name} and rig sweep {name} make its depth better",
    "That of an\n# OAK-D; the device's own calibration finds the rest.",
    "# Where each lens centre is, in view steps right of and below the reference.",
    """\
# Nearest and farthest distance of the scene, mm; outside there is no depth. Slopes follow from the
# device's own calibration, or from a better one. Narrow is faster and safer.
[slopes]
range_mm = [{near_mm}, 4000.0]

# A run that misses one of these ends with exit code 3. After the sweep depth_sigma_pct can be 1.
[quality]
depth_sigma_pct = 3.0 # largest 1 sigma of a depth: a factory knows 2 m to about 1 %
""",
)

_ONE_CAMERA = """\
# One camera of {title}. Written by `rig profile new`; lines that say MEASURE hold guesses.
# Next: rig calibrate {name}, then rig export 1 --format opencv, or ros.
{notes}name = "{name}"
description = "one camera, to be calibrated by itself"

[[views]]
name = "camera"
"""
_TARGET = """\
[target]
kind = "checkerboard"
columns = 9       # INNER corners, one less than squares
rows = 6
square_mm = 25.0  # MEASURE across ten squares: a print is rarely true
"""
_SWEEP = """\
[sweep]
from_mm = {near_mm}
to_mm = {far_mm}
count = 17
samples = 5
settle_s = 0.4    # rig check says whether it is enough

{slopes}holdout_rms_pct = 0.2
holdout_max_pct = 0.5
line_rms_px = 0.5 # corners beside their epipolar lines: `rig calibrate` makes the views rectified
"""


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a new profile describes."""

    name: str
    camera: str
    """Kind of camera, one that has a template."""
    views: int
    """How many views, 1 to 5."""
    stage: str | None
    """Kind of stage, one that has a template; None for none."""
    cameras: tuple[str, ...] = ()
    """Names of the cameras that are plugged in, as the search of the kind gives them."""
    stages: tuple[str, ...] = ()
    """Names of what may be the stage, as the search of the kind gives them."""
    notes: tuple[str, ...] = field(default=())
    """Lines for the head of the file."""
    layout: str | None = None
    """How all views lie in the picture of one device; None where each has its own."""
    told: ToldViews | None = None
    """What the camera has told of its views; None where it was not asked."""
    picture: FoundPicture | None = None
    """The best picture that the first camera offers; None where it does not tell."""
    target: TargetConfig | None = None
    """What is shown to the cameras; None for a board that is a guess."""


def profile_text(recipe: Recipe) -> str:
    """Return a profile as TOML with comments; it loads as it is.

    Raises:
        ConfigError: a number of views that no arrangement is known for, a kind without template, or
            a layout with too few places.
    """
    if not 1 <= recipe.views <= len(PLACES):
        raise ConfigError(
            f"asked for {recipe.views} views, a new profile has 1 to {len(PLACES)}",
            advice="write further [[views]] by hand",
        )
    camera = camera_template(recipe.camera)
    if recipe.views == 1:
        return _one_camera(camera, recipe)
    built_in, names = _arranged(camera, recipe)
    if built_in is not None:
        words, pitch_mm, places = _BUILT_IN, built_in.pitch_mm, built_in.places
    else:
        words, pitch_mm = _MEASURED, _PITCH_MM
        places = dict(zip(names, PLACES.values(), strict=False))
    width_px, height_px = 1280, 800
    layout = _layout(camera, recipe)
    sensors = None if recipe.told is None else recipe.told.sensors
    slope_px = pitch_mm * _FOCAL_PER_WIDTH * width_px
    parts = [
        _HEAD.format(
            name=recipe.name,
            next=words.next.format(name=recipe.name),
            description=f"{recipe.views} {camera.title}, {recipe.stage or 'no'} stage",
            notes="".join(f"# {note}\n" for note in recipe.notes),
            pitch_mm=pitch_mm,
            pitch_note=words.pitch,
            places_note=words.places,
        ),
        *(_view(name, places[name]) for name in names),
        camera.section(
            NewCamera(names, recipe.cameras, width_px, height_px, layout, recipe.picture, sensors)
        ),
    ]
    if recipe.stage is not None:
        stage = stage_template(recipe.stage)
        parts.append(stage.section(NewStage(recipe.stages, _NEAR_MM, _FAR_MM)))
    low_px, high_px = slope_px / _FAR_MM / _ROOM, slope_px / _NEAR_MM * _ROOM
    slopes = words.slopes.format(low_px=round(low_px), high_px=round(high_px), near_mm=_NEAR_MM)
    parts.append(_target(recipe))
    parts.append(_SWEEP.format(near_mm=_NEAR_MM, far_mm=_FAR_MM, slopes=slopes))
    return "\n".join(parts)


def _arranged(camera: CameraTemplate, recipe: Recipe) -> tuple[BuiltIn | None, tuple[str, ...]]:
    """Return where the views are, None where that must be measured; and their names."""
    if recipe.told is None:
        known = next((b for b in camera.built_in if recipe.views == len(b.places)), None)
        return known, tuple(PLACES if known is None else known.places)[: recipe.views]
    names = tuple(recipe.told.sensors)
    same = (b for b in camera.built_in if set(b.places) == set(names))
    return recipe.told.built_in or next(same, None), names


def _one_camera(camera: CameraTemplate, recipe: Recipe) -> str:
    """A profile of one camera alone: it has no steps, no slopes and no sweep."""
    if recipe.layout is not None or recipe.stage is not None:
        raise ConfigError(
            "asked for one view with "
            f"{'a layout' if recipe.layout else f'the stage {recipe.stage}'}",
            advice="one camera alone is calibrated by a board in the hand: --stage none, and no "
            "--layout",
        )
    sensors: dict[str, ToldSensor] | None = None
    if recipe.told is not None:
        (sensor,) = recipe.told.sensors.values()
        sensors = {"camera": sensor}
    section = camera.section(
        NewCamera(("camera",), recipe.cameras, 1280, 800, None, recipe.picture, sensors)
    )
    notes = "".join(f"# {note}\n" for note in recipe.notes)
    head = _ONE_CAMERA.format(name=recipe.name, title=camera.title, notes=notes)
    return f"{head}\n{section}\n{_target(recipe)}"


def _target(recipe: Recipe) -> str:
    return _TARGET if recipe.target is None else section_text("target", recipe.target)


def camera_template(kind: str) -> CameraTemplate:
    """Return how a new profile describes a kind of camera.

    Raises:
        ConfigError: there is no such kind, or it has no template.
    """
    template = CAMERAS.kind(kind).template
    if template is None:
        raise _without_template("camera", kind, new_cameras())
    return template


def stage_template(kind: str) -> StageTemplate:
    """Return how a new profile describes a kind of stage.

    Raises:
        ConfigError: there is no such kind, or it has no template.
    """
    template = STAGES.kind(kind).template
    if template is None:
        raise _without_template("stage", kind, new_stages())
    return template


def new_cameras() -> tuple[str, ...]:
    """Return the kinds of cameras that a new profile can have."""
    return tuple(kind.name for kind in CAMERAS.kinds() if kind.template is not None)


def new_stages() -> tuple[str, ...]:
    """Return the kinds of stages that a new profile can have; the first is the likeliest."""
    return tuple(kind.name for kind in STAGES.kinds() if kind.template is not None)


def _layout(camera: CameraTemplate, recipe: Recipe) -> str | None:
    if recipe.layout is None:
        return None
    if not camera.takes_layout:
        raise ConfigError(
            f"asked for {camera.title} with the layout {recipe.layout}, they have no layout",
            advice="leave --layout out",
        )
    if recipe.views > places_of(recipe.layout):
        raise ConfigError(
            f"asked for {recipe.views} views in a picture of the layout {recipe.layout}, which has "
            f"{places_of(recipe.layout)}",
            advice=f"ask for fewer, or choose one of {', '.join(layouts())}",
        )
    return recipe.layout


def _without_template(noun: str, kind: str, known: tuple[str, ...]) -> ConfigError:
    return ConfigError(
        f"asked for a new profile with the {noun} {kind}, which has no template",
        advice=f"choose one of {', '.join(known)}, or copy a profile: --from NAME",
    )


def _view(name: str, place: tuple[float, float]) -> str:
    x_steps, y_steps = place
    is_reference = place == (0.0, 0.0)
    comment = " # the reference: depth counts from its optical centre" if is_reference else ""
    return f'[[views]]\nname = "{name}"{comment}\nx_steps = {x_steps}\ny_steps = {y_steps}\n'
