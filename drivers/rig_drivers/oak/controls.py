"""Exposure, gain, focus and white balance: set once, and read back with every frame."""

from dataclasses import dataclass
from typing import Self

from rig.errors import ControlError
from rig.profile import OakCameraConfig
from rig_drivers.oak.sdk import dai

_EXPOSURE_SHARE = 0.02
_EXPOSURE_S = 50e-6
"""Sensors count exposure in lines of 7-30 us."""
_ISO_SHARE = 0.04
_ISO = 7
"""Sensors count gain in sixteenths: 6.25 at ISO 100."""
_WHITE_BALANCE_K = 100
_NEVER = "nothing; it does not report this value"


@dataclass(frozen=True, slots=True)
class Applied:
    """What a frame says about its own exposure."""

    exposure_s: float
    iso: int
    lens_position: int
    """0..255; -1 where the sensor has no motor."""
    white_balance_k: int

    @classmethod
    def of(cls, frame: dai.ImgFrame) -> Self:
        """Read the values that came with a frame."""
        return cls(
            frame.getExposureTime().total_seconds(),
            frame.getSensitivity(),
            frame.getLensPosition(),
            frame.getColorTemperature(),
        )


@dataclass(frozen=True, slots=True)
class Controls:
    """What every sensor of a camera is told."""

    exposure_s: float
    iso: int
    lens_position: int | None
    white_balance_k: int | None

    @classmethod
    def of(cls, config: OakCameraConfig) -> Self:
        """Read the values of a profile."""
        return cls(config.exposure_s, config.iso, config.lens_position, config.white_balance_k)

    def set_on(self, control: dai.CameraControl) -> None:
        """Write everything into a control message; nothing is left to automatics.

        Sharpening and noise reduction are switched off: they move edges and correlate the noise
        whose level the slopes' sigma rests on.
        """
        control.setManualExposure(round(self.exposure_s * 1e6), self.iso)
        if self.lens_position is not None:
            control.setAutoFocusMode(dai.CameraControl.AutoFocusMode.OFF)
            control.setManualFocus(self.lens_position)
        if self.white_balance_k is not None:
            control.setManualWhiteBalance(self.white_balance_k)
        control.setSharpness(0)
        control.setLumaDenoise(0)
        control.setChromaDenoise(0)

    def require(self, applied: Applied, device: str) -> None:
        """Compare what was asked for with what a frame was taken with.

        Args:
            applied: the frame's own values.
            device: name of camera and view, for messages.

        Raises:
            ControlError: a value differs by more than the steps of a sensor.
        """
        allowed_s = max(_EXPOSURE_S, _EXPOSURE_SHARE * self.exposure_s)
        if abs(applied.exposure_s - self.exposure_s) > allowed_s:
            _refuse(device, "exposure_s", f"{self.exposure_s:.6f} s", applied.exposure_s, " s")
        if abs(applied.iso - self.iso) > max(_ISO, _ISO_SHARE * self.iso):
            _refuse(device, "iso", str(self.iso), applied.iso, "")
        if self.lens_position is not None and applied.lens_position != self.lens_position:
            _refuse(device, "lens_position", str(self.lens_position), applied.lens_position, "")
        balance_k = self.white_balance_k
        if balance_k is not None and abs(applied.white_balance_k - balance_k) > _WHITE_BALANCE_K:
            _refuse(device, "white_balance_k", f"{balance_k} K", applied.white_balance_k, " K")


def _refuse(device: str, control: str, wanted: str, applied: float, unit: str) -> None:
    shown = f"{applied:.6f}" if isinstance(applied, float) else str(applied)
    raise ControlError(
        device,
        control=control,
        wanted=wanted,
        applied=f"{shown}{unit}" if applied > 0 else _NEVER,
        then=f"set camera.{control} to what the sensor can keep",
    )
