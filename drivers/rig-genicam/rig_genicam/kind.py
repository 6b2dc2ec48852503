"""What rig has to know of GenICam cameras; Aravis is loaded when they are sought or opened."""

import json

from rig.devices import Camera, SystemClock
from rig.discovery import FoundDevice, Search
from rig.profile.kinds import CameraKind, CameraTemplate, NewCamera, Surroundings
from rig_genicam.config import GenicamCameraConfig

_SECTION = """\
[camera]
kind = "genicam"
width_px = {width_px}       # MEASURE: what the cameras offer (`arv-tool-0.8 values`)
height_px = {height_px}
rate_hz = 20
pixel_format = "Mono8"  # or Mono12p, BayerRG8 ...
exposure_s = 0.008      # locked; the white squares should reach 70 % of full scale
# gain = 6.0            # lock it too: mostly dB
max_skew_s = 0.001

# What starts an exposure. Software: rig fires all at once. Better: one pulse into every camera.
[camera.trigger]
source = "Software"     # or an input: "Line1", then also activation = "RisingEdge"

# By view name: serial number, name or address. MEASURE: cover one lens after the other.
[camera.devices]
{devices}
"""


def _open(config: GenicamCameraConfig, around: Surroundings) -> Camera:
    from rig_drivers.array.camera_array import CameraArray

    from rig_genicam.aravis import load_aravis
    from rig_genicam.aravis_library import AravisLibrary
    from rig_genicam.camera import GenicamCamera

    library, clock = AravisLibrary(load_aravis()), SystemClock()
    views = [view.name for view in around.views]
    return CameraArray(
        [GenicamCamera(config, view, library=library, clock=clock) for view in config.devices],
        views=views,
        period_s=1.0 / config.rate_hz,
        max_skew_s=config.max_skew_s,
        timeout_s=config.timeout_s,
    )


def _find(_timeout_s: float) -> list[FoundDevice]:
    from rig_genicam.aravis import load_aravis
    from rig_genicam.aravis_library import AravisLibrary

    offers = AravisLibrary(load_aravis()).offers()
    serials = [offer.serial for offer in offers]
    found: list[FoundDevice] = []
    for offer in offers:
        is_alone = bool(offer.serial) and serials.count(offer.serial) == 1
        names = [offer.serial, offer.name, offer.address] if is_alone else [offer.name]
        best, *others = dict.fromkeys(name for name in names if name)
        what = " ".join(filter(None, (offer.vendor, offer.model)))
        found.append(FoundDevice(best, f"{what}; {offer.protocol}", tuple(others)))
    return found


def _section(new: NewCamera) -> str:
    lines = [
        f"{view} = {json.dumps(_device_of(view, place, new.devices))}"
        for place, view in enumerate(new.views)
    ]
    lines += [f"# also there: {name}" for name in new.devices[len(new.views) :]]
    return _SECTION.format(width_px=new.width_px, height_px=new.height_px, devices="\n".join(lines))


def _device_of(view: str, place: int, there: tuple[str, ...]) -> str:
    return there[place] if place < len(there) else f"REPLACE-BY-THE-SERIAL-NUMBER-OF-{view}"


GENICAM = CameraKind(
    contract=1,
    name="genicam",
    config=GenicamCameraConfig,
    open=_open,
    search=Search("genicam", "camera.devices", _find, "GenICam cameras"),
    template=CameraTemplate("GenICam cameras", _section),
)
