"""OAK cameras as a kind of camera: devices, or simulated sensors in their place."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, cast

from rig.devices import Camera
from rig.discovery import FoundDevice, Search
from rig.profile import OakCameraConfig
from rig.profile.kinds import BuiltIn, CameraKind, CameraTemplate, NewCamera, Surroundings

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
# lens_position = 130  # only for sensors with autofocus, and then needed
{skew}

# By view name: the board socket of its sensor.
[camera.sockets]
{sockets}
"""
_IN_STEP = "max_skew_s = 0.005"
_OUT_OF_STEP = (
    "max_skew_s = 0.045     # the colour camera keeps no step with the pair: scenes at rest"
)
_COLOUR = """
# What is different for the colour camera.
[camera.sensors.colour]
width_px = 1920
height_px = 1080
pixels = "nv12"        # grey and colour
lens_position = 130    # locks autofocus. MEASURE: sharp in the middle of your distances
white_balance_k = 5000 # locked as well
"""
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


def _section(new: NewCamera) -> str:
    if set(new.views) <= set(_OF_OAK_D):
        sockets = {view: _OF_OAK_D[view] for view in new.views}
    else:
        sockets = dict(zip(new.views, _SOCKETS, strict=False))
    section = _SECTION.format(
        device=json.dumps(new.devices[0] if new.devices else ""),
        width_px=new.width_px,
        height_px=new.height_px,
        skew=_OUT_OF_STEP if "colour" in sockets else _IN_STEP,
        sockets="\n".join(f'{view} = "{socket}"' for view, socket in sockets.items()),
    )
    if "colour" in sockets:
        return section + _COLOUR
    return section + (_PAIR_ALONE if new.views == tuple(_PAIR.places) else "")


OAK = CameraKind(
    contract=1,
    name="oak",
    config=OakCameraConfig,
    open=_open,
    search=Search("oak", "camera.device", _find, "OAK cameras"),
    template=CameraTemplate("OAK sensors", _section, views=2, built_in=(_PAIR, _ALL)),
)
