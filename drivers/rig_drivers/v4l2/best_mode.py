"""Which of the modes that a camera offers a new profile begins with."""

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Final

from rig_drivers.v4l2.formats import Mode, SizeOffer, rate_offers
from rig_drivers.v4l2.node import Node
from rig_drivers.v4l2.pixels import DECODERS

_WIDEST_PX, _HIGHEST_PX = 1280, 800
"""More pixels are for those who know their bus."""
_USUAL_HZ: Final = 30.0
_SLOWEST_HZ: Final = 10.0
"""A slower mode is none to look through while a board is carried about."""
_LAST: Final = ("MJPG", "JPEG")
"""Lossy: where nothing else is fast enough."""
_OF_TWO_VIEWS: Final = ("Y8I", "Y12I")


def best_mode(node: Node, offers: Sequence[SizeOffer]) -> Mode | None:
    """Return what a new profile asks a camera for.

    The first format in the order of `DECODERS` (grey, colour, mosaics), the compressed ones last,
    that has a size of up to 1280 px width at 10 Hz and more; of that the largest size, at the rate
    nearest to 30 Hz.

    Args:
        node: open.
        offers: of this node.

    Returns:
        None where it does not tell sizes and rates.
    """
    formats = [name for name in DECODERS if name not in _LAST + _OF_TWO_VIEWS]
    for name in (*formats, *_LAST):
        modes = [
            mode
            for offer in offers
            if offer.is_told and offer.pixel_format == name
            for mode in [_usual(node, offer)]
            if mode is not None
        ]
        if modes:
            return max(modes, key=lambda mode: mode.width_px * mode.height_px)
    return None


def _usual(node: Node, offer: SizeOffer) -> Mode | None:
    width_px, height_px = offer.width_px.nearest(_WIDEST_PX), offer.height_px.nearest(_HIGHEST_PX)
    if width_px > _WIDEST_PX:
        return None
    mode = Mode(offer.pixel_format, width_px, height_px)
    usual_s = Fraction(1) / Fraction(_USUAL_HZ)
    rates_hz = [float(1 / rate.nearest(usual_s)) for rate in rate_offers(node, mode)]
    fitting = [rate_hz for rate_hz in rates_hz if rate_hz >= _SLOWEST_HZ]
    if not fitting:
        return None
    rate_hz = min(fitting, key=lambda rate_hz: abs(math.log(rate_hz / _USUAL_HZ)))
    return replace(mode, rate_hz=round(rate_hz, 3))
