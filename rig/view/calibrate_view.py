"""The live page of a calibration: corners as found, what is covered, and what to show next."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.calibrate.watch import Look
from rig.targets import Detection
from rig.view.packing import as_8_bit
from rig.view.server import ViewServer
from rig.view.wire import encode


@dataclass(frozen=True, slots=True)
class CalibrateMessage:
    """One look; its pictures are worked out for those who look on only."""

    look: Look

    def encoded(self, number: int, wants: frozenset[str]) -> bytes:
        """Return header and arrays: `view_0`, `view_1`, ... (views may differ in size)."""
        look = self.look
        frames = look.picture.multiview.frames
        arrays = {
            f"view_{i}": as_8_bit(one.image, one.full_scale.bit_length())
            for i, one in enumerate(frames)
            if "views" in wants
        }
        profile, coverage = look.profile, look.coverage
        header = {
            "rig": profile.name,
            "views": [{"name": one.view} for one in frames],
            "reference": profile.reference,
            "x_steps": [view.x_steps for view in profile.views],
            "y_steps": [view.y_steps for view in profile.views],
            "corners": [_corners(found) for found in look.sightings.by_view],
            "problems": [
                None if isinstance(found, Detection) else found.found
                for found in look.sightings.by_view
            ],
            "moving": look.is_moving,
            "kept": look.kept,
            "advice": look.advice,
            "cells": None if coverage is None else (coverage.cells > 0).tolist(),
            "errors": [[count, pct] for count, pct in look.errors if math.isfinite(pct)],
        }
        return encode({"mode": "calibrate", "number": number, **header}, arrays)


def _corners(found: object) -> list[Any]:
    return np.round(found.xy_px, 2).tolist() if isinstance(found, Detection) else []


class CalibrateView:
    """Shows every look to whoever looks on.

    Args:
        server: started; closed by whoever started it.
    """

    def __init__(self, server: ViewServer[CalibrateMessage]) -> None:
        self._server = server

    def show(self, look: Look) -> None:
        """Make it the newest; a `Watch`."""
        self._server.publish(CalibrateMessage(look))
