"""OAK cameras as a kind of camera: devices, or simulated sensors in their place."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, cast

from rig.devices import Camera
from rig.discovery import FoundDevice, Search
from rig.profile import OakCameraConfig
from rig.profile.kinds import (
    BuiltIn,
    CameraKind,
    CameraTemplate,
    NewCamera,
    Surroundings,
    ToldSensor,
    ToldViews,
)

if TYPE_CHECKING:
    from rig_drivers.oak.host_sensors import SourceRack
    from rig_drivers.oak.sensors import Sensors

_PAIR = BuiltIn(75.0, {"left": (0.0, 0.0), "right": (1.0, 0.0)})
"""The monochrome pair of an OAK-D and its kin, seen from behind."""
_ALL = BuiltIn(37.5, {"colour": (0.0, 0.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)})
"""The pair with the colour camera between."""
_OF_OAK_D = {"colour": "CAM_A", "left": "CAM_B", "right": "CAM_C"}
_SOCKETS = ("CAM_A", "CAM_B", "CAM_C", "CAM_D", "CAM_E")
_SECTION = """\
[camera]
kind = "oak"
device = {device}        # id of the device; empty takes the only one there is
width_px = {width_px}
height_px = {height_px}
rate_hz = 10           # low is cool, and leaves bandwidth
exposure_s = 0.008     # locked; the white squares should reach 70 % of full scale
iso = 100
{locks}
{skew}

# By view name: the board socket of its sensor.
[camera.sockets]
{sockets}
"""
_IN_STEP = "max_skew_s = 0.005"
_OUT_OF_STEP = (
    "max_skew_s = 0.045     # the colour camera keeps no step with the pair: scenes at rest"
)
_NO_LENS = "# lens_position = 130  # only for sensors with autofocus, and then needed"
_LENS = "lens_position = 130    # locks autofocus. MEASURE: sharp in the middle of your distances"
_WHITE = "white_balance_k = 5000 # locked as well\n"
_OF_ITS_OWN = """
# What is different for this sensor.
[camera.sensors.{view}]
width_px = {width_px}
height_px = {height_px}
pixels = {pixels}        # {note}
{lens}{white}"""
_COLOUR_SENSOR = ToldSensor("CAM_A", 1920, 1080, has_colour=True, has_autofocus=True)
_PAIR_ALONE = "# An OAK-D has a colour camera (CAM_A) as well: --views 3 describes all three.\n"


class _SimulatedSensors(Protocol):
    """What a simulated bench must have for this kind."""

    def oak_rack(
        self, config: OakCameraConfig, *, device: str, views: tuple[str, ...]
    ) -> "SourceRack": ...


def _open(config: OakCameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.oak.camera import OakCamera

    views = [view.name for view in around.views]
    cameras = [
        OakCamera(
            config,
            [view for view in views if view in sockets],
            _sensors(config, device, sockets, around),
            around.clock,
        )
        for device, sockets in config.by_device.items()
    ]
    if len(cameras) == 1:
        return cameras[0]
    from rig_drivers.array.camera_array import CameraArray

    return CameraArray(
        cameras,
        views=views,
        period_s=1.0 / config.rate_hz,
        max_skew_s=config.max_skew_s,
        timeout_s=config.timeout_s,
    )


def _sensors(
    config: OakCameraConfig, device: str, sockets: Mapping[str, str], around: Surroundings
) -> "Sensors":
    if not config.is_simulated:
        from rig_drivers.oak.device_sensors import DeviceSensors

        return DeviceSensors(config, device, sockets)
    from rig_drivers.oak.host_sensors import HostSensors

    simulated = cast("_SimulatedSensors", around.simulated)
    return HostSensors(simulated.oak_rack(config, device=device, views=tuple(sockets)))


def _find(timeout_s: float) -> Sequence[FoundDevice]:
    from rig_drivers.oak.inventory import list_oaks

    return list_oaks(timeout_s)


def _ask(device: str, timeout_s: float) -> ToldViews:
    from rig_drivers.oak.inventory import list_sensors
    from rig_drivers.oak.new_views import views_of

    return views_of(list_sensors(device, timeout_s), device)


def _section(new: NewCamera) -> str:
    if new.sensors is not None:
        return _told_section(new, new.sensors)
    if set(new.views) <= set(_OF_OAK_D):
        sockets = {view: _OF_OAK_D[view] for view in new.views}
    else:
        sockets = dict(zip(new.views, _SOCKETS, strict=False))
    size_px = (new.width_px, new.height_px)
    section = _head(new, sockets, size_px, has_unlike="colour" in sockets, locks=_NO_LENS)
    if "colour" in sockets:
        return section + _unlike("colour", _COLOUR_SENSOR)
    return section + (_PAIR_ALONE if new.views == tuple(_PAIR.places) else "")


def _told_section(new: NewCamera, sensors: Mapping[str, ToldSensor]) -> str:
    """Describe the sensors that the device has told of: the commonest kind, and the others.

    What is said of all holds for each, so one without autofocus leads; of two kinds as common the
    grey one: it is the pair of an OAK-D and its kin.
    """
    counts = Counter(_like(sensor) for sensor in sensors.values())
    common = max(counts, key=lambda like: (not like[3], counts[like], not like[2]))
    unlike = {view: sensor for view, sensor in sensors.items() if _like(sensor) != common}
    sockets = {view: sensor.socket for view, sensor in sensors.items()}
    locks = (_LENS if common[3] else _NO_LENS) + (f"\n{_WHITE}".rstrip() if common[2] else "")
    section = _head(new, sockets, common[:2], has_unlike=bool(unlike), locks=locks)
    return section + "".join(_unlike(view, sensor) for view, sensor in unlike.items())


def _like(sensor: ToldSensor) -> tuple[int, int, bool, bool]:
    """What sensors of one kind have in common, as far as a profile tells it."""
    return sensor.width_px, sensor.height_px, sensor.has_colour, sensor.has_autofocus


def _head(
    new: NewCamera,
    sockets: Mapping[str, str],
    size_px: tuple[int, int],
    *,
    has_unlike: bool,
    locks: str,
) -> str:
    width_px, height_px = size_px
    return _SECTION.format(
        device=json.dumps(new.devices[0] if new.devices else ""),
        width_px=width_px,
        height_px=height_px,
        locks=locks,
        skew=_OUT_OF_STEP if has_unlike else _IN_STEP,
        sockets="\n".join(f'{view} = "{socket}"' for view, socket in sockets.items()),
    )


def _unlike(view: str, sensor: ToldSensor) -> str:
    pixels, white = ('"nv12"', _WHITE) if sensor.has_colour else ('"gray8"', "")
    return _OF_ITS_OWN.format(
        view=view,
        width_px=sensor.width_px,
        height_px=sensor.height_px,
        pixels=pixels,
        note="grey and colour" if sensor.has_colour else "grey",
        lens=f"{_LENS}\n" if sensor.has_autofocus else "",
        white=white,
    )


OAK = CameraKind(
    contract=1,
    name="oak",
    config=OakCameraConfig,
    open=_open,
    search=Search("oak", "camera.device", _find, "OAK cameras"),
    template=CameraTemplate("OAK sensors", _section, views=2, built_in=(_PAIR, _ALL), ask=_ask),
)
