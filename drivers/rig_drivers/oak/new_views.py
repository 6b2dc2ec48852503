"""From what an OAK tells of its sensors to the views of a new profile."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

from rig.errors import DeviceNotFoundError
from rig.profile.kinds import BuiltIn, ToldSensor, ToldViews
from rig_drivers.oak.answer import SensorAnswer

_WIDEST_PX: Final = 1920
"""A new profile asks for no wider pictures: more is for those who know their link."""
_STEP_IS_NONE: Final = 0.05
"""Part of a view step below which a lens stands in the row, or in the column."""
_OAK_D: Final = ("CAM_A", "CAM_B", "CAM_C")


def views_of(sensors: Sequence[SensorAnswer], device: str) -> ToldViews:
    """Return the views of a new profile: every sensor that gives pictures.

    Args:
        sensors: in the order of their sockets.
        device: names it in errors.

    Raises:
        DeviceNotFoundError: it has none.
    """
    if not sensors:
        raise DeviceNotFoundError(
            f"OAK {device}", "finds no sensor that gives pictures", advice="seat its ribbon cables"
        )
    named = dict(zip(_names(sensors), sensors, strict=True))
    told = {view: _told(sensor) for view, sensor in named.items()}
    return ToldViews(told, _places(named))


def _names(sensors: Sequence[SensorAnswer]) -> Sequence[str]:
    """Name the views of an OAK-D as a person sees them, others by their sockets."""
    sockets = tuple(sensor.socket for sensor in sensors)
    is_pair = not any(sensor.has_colour for sensor in sensors[-2:])
    if sockets == _OAK_D and sensors[0].has_colour and is_pair:
        return ("colour", "left", "right")
    if sockets == _OAK_D[1:]:
        return ("left", "right")
    return [socket.lower() for socket in sockets]


def _told(sensor: SensorAnswer) -> ToldSensor:
    fitting = [size for size in sensor.sizes_px if size[0] <= _WIDEST_PX]
    width_px, height_px = max(fitting, default=min(sensor.sizes_px))
    return ToldSensor(sensor.socket, width_px, height_px, sensor.has_colour, sensor.has_autofocus)


def _places(named: Mapping[str, SensorAnswer]) -> BuiltIn | None:
    """Count the places of the device's own calibration in the nearest neighbour's distance."""
    places_mm = {view: sensor.place_mm for view, sensor in named.items()}
    known = {view: place for view, place in places_mm.items() if place is not None}
    if len(known) < max(2, len(places_mm)):
        return None
    _, *others = known.values()
    pitch_mm = min(math.hypot(x, y) for x, y, _ in others)
    if pitch_mm == 0.0:
        return None

    def steps(way_mm: float) -> float:
        count = round(way_mm / pitch_mm, 2)
        return count if abs(count) >= _STEP_IS_NONE else 0.0

    places = {view: (steps(x), steps(y)) for view, (x, y, _) in known.items()}
    return BuiltIn(round(pitch_mm, 2), places)
