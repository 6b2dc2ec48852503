"""Sub-aperture views of raw pictures, as a camera."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from rig.devices import Camera, not_open
from rig.errors import DeviceLostError, DeviceNotFoundError
from rig.frames import Frame, GreyImage, MultiView
from rig.lenslet.array import ARRAY_JSON, LensletArray
from rig.lenslet.match import shows_the_lattice
from rig.lenslet.plan import Plan, plan_views
from rig.lenslet.views import sub_apertures
from rig.profile import LensletCameraConfig, ViewConfig
from rig.profile.kinds import Surroundings
from rig_drivers.stored.picture import read_grey

_NAME = "camera lenslet"


class LensletCamera:
    """Gives the views of a profile from the raw pictures of another camera; keeps `Camera`.

    Args:
        config: the lattice, and the calibrated array that a run put there.
        around: views and name of the profile.
        inside: the camera that gives raw pictures, not yet open.
    """

    def __init__(self, config: LensletCameraConfig, around: Surroundings, inside: Camera) -> None:
        self._config = config
        self._views: tuple[ViewConfig, ...] = around.views
        self._profile = around.profile
        self._inside = inside
        self._array: LensletArray | None = None
        self._plan: Plan | None = None
        self._dark: GreyImage | None = None
        self._is_looked_at = False

    def __enter__(self) -> Self:
        """Open the camera inside, with the calibrated array.

        Raises:
            DeviceNotFoundError: the array is not calibrated.
            CalibrationError: a view has no place in its micro-images.
        """
        if self._config.lenslets is None:
            raise DeviceNotFoundError(
                _NAME,
                f"no calibration of the lenslets of {self._profile} is stored or chosen",
                advice=f"run `rig calibrate {self._profile} --white FILE` first",
            )
        self._array = ARRAY_JSON.from_json(self._config.lenslets)
        places = [(view.x_steps, view.y_steps) for view in self._views]
        self._plan = plan_views(self._array, np.array(places) * self._config.step_px)
        self._dark = None if self._config.dark is None else read_grey(Path(self._config.dark))
        self._is_looked_at = False
        self._inside.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._array = self._plan = self._dark = None
        self._inside.__exit__(kind, error, trace)

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return tuple(view.name for view in self._views)

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`: that of the camera inside, which says so."""
        inside = self._inside.identity
        return {**inside, "kind": "lenslet", "raw": inside.get("kind", "")}

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`."""
        return self._inside.dropped

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        self._require_open()
        return self._seen(self._inside.grab(timeout_s))

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        self._require_open()
        for multiview in self._inside.stream():
            yield self._seen(multiview)

    def _require_open(self) -> None:
        if self._plan is None:
            raise not_open(_NAME)

    def _seen(self, multiview: MultiView) -> MultiView:
        if self._array is None or self._plan is None:
            raise not_open(_NAME)
        (raw,) = multiview.frames
        self._require_like(raw, self._array)
        images = sub_apertures(raw.image, self._array, self._plan, self._dark)
        frames = tuple(
            replace(raw, view=name, image=image, bits=None)
            for name, image in zip(self.views, images, strict=True)
        )
        return MultiView(frames, multiview.temperature_degc)

    def _require_like(self, raw: Frame, array: LensletArray) -> None:
        """Refuse raw pictures of another camera than the calibrated one.

        Raises:
            DeviceLostError: size or bits differ, or micro-images lie elsewhere.
        """
        height_px, width_px = raw.image.shape
        bits = self._config.bits
        full_scale = raw.full_scale if bits is None else (1 << bits) - 1
        asked = (*array.vignetting.size_px, array.full_scale)
        if (width_px, height_px, full_scale) != asked:
            raise DeviceLostError(
                _NAME,
                f"a raw picture of {width_px} x {height_px} px up to grey value {full_scale} came, "
                f"the lenslets were calibrated with {asked[0]} x {asked[1]} px up to {asked[2]}",
                advice=f"set the camera as it was, or run `rig calibrate {self._profile}` again",
            )
        if self._is_looked_at:
            return
        if not shows_the_lattice(raw.image, array):
            raise DeviceLostError(
                _NAME,
                "the raw picture is as bright between the micro-images of the calibration as inside"
                " them: its lattice lies elsewhere",
                advice=f"run `rig calibrate {self._profile}` with a white picture of this camera, "
                "at the zoom and focus in use",
            )
        self._is_looked_at = True
