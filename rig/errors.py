"""Everything rig refuses, as a small tree.

RigError
├── ConfigError (ValueError)          a profile or plan that cannot be used
│   └── OptionError                   an option of the command line that cannot be used
├── DeviceError                       carries the name of the device
│   ├── DeviceNotFoundError           it is not there, or may not be opened
│   │   └── DevicesNotFoundError      several are not; carries the error of each
│   ├── DeviceLostError               it was there and is gone, or talks nonsense
│   ├── CameraUseError                a program uses an opened rig in a way that it cannot be used
│   ├── CaptureTimeoutError (TimeoutError)   not all views arrived in time
│   ├── SceneMovedError               the scene moved, or flickered, while a camera scanned it
│   ├── ViewSkewError                 views of one grab are too far apart in time
│   ├── ControlError                  a camera control is not what was asked for
│   ├── StageLimitError (ValueError)  the move leaves the travel; nothing moved
│   ├── StageAlarmError               the controller refused or stopped; carries its code
│   ├── StageTimeoutError (TimeoutError)     no answer, or the move did not end in time
│   └── StagePositionError            it stopped elsewhere than it was told to
├── TargetError                       no board, or not the board asked for, or it moved
├── CalibrationError                  sightings that do not determine the cameras and their places
├── SlopeError                        images that give no slope
├── CurveError                        too few or contradictory distances, or another rig's curve
├── FormatError                       a file of another tool's format, or what it cannot hold
├── OutputError                       what takes the frames of a capture does not
└── StoreError                        database or frame folder cannot be read or written
    └── OwnedError                    another program works on it

Each carries what was asked and found (with units) and what to do next, as two fields; its text
is both, joined by a semicolon. Programs read the fields and never cut the text.
"""

from collections.abc import Iterable, Mapping, Sequence

_MOST_SIGNS = 1200
"""Of each part of a message: a name in a file from outside can have any length."""


def _bounded(text: str) -> str:
    half = _MOST_SIGNS // 2
    return text if len(text) <= _MOST_SIGNS else f"{text[:half]} ... {text[-half:]}"


class RigError(Exception):
    """Base of every error that rig raises on purpose; the command line prints it as one line.

    Args:
        found: what was asked and what was found, with numbers and units.
        advice: what to do next; empty where whoever passes the error on knows it and this place
            does not.
    """

    def __init__(self, found: str, *, advice: str = "") -> None:
        found, advice = _bounded(found), _bounded(advice)
        super().__init__(f"{found}; {advice}" if advice else found)
        self.found = found
        self.advice = advice


def every_advice(errors: Iterable[RigError]) -> str:
    """Return what to do about several errors, the same advice once."""
    return "; ".join(dict.fromkeys(error.advice for error in errors if error.advice))


class ConfigError(RigError, ValueError):
    """A profile, plan or option cannot be used as it is written."""


class OptionError(ConfigError):
    """What stands in an option of the command line cannot be used; exit code 2."""


class DeviceError(RigError):
    """Something went wrong with one device.

    Args:
        device: its name.
        symptom: what was asked and found; `found` is this behind the name.
        advice: see `RigError`.
    """

    def __init__(self, device: str, symptom: str, *, advice: str = "") -> None:
        super().__init__(f"{device}: {symptom}", advice=advice)
        self.device = device
        self.symptom = symptom


class DeviceNotFoundError(DeviceError):
    """The device is not there, is used by another program, or may not be opened."""


class DevicesNotFoundError(DeviceNotFoundError):
    """Several devices did not open; what is the same for all of them is said once.

    Args:
        device: names all of them together.
        errors: of those that did not open.
        asked: how many were to open.
    """

    def __init__(self, device: str, errors: Sequence[DeviceError], *, asked: int) -> None:
        by_symptom: dict[str, list[str]] = {}
        for error in errors:
            by_symptom.setdefault(error.symptom, []).append(error.device)
        told = "; ".join(f"{', '.join(names)}: {text}" for text, names in by_symptom.items())
        super().__init__(
            device,
            f"{len(errors)} of {asked} did not open: {told}",
            advice=every_advice(errors),
        )
        self.errors = tuple(errors)


class DeviceLostError(DeviceError):
    """The device answered before and does not any more; it must be opened again."""


class CameraUseError(DeviceError):
    """A program used a camera outside of `with`, opened it twice, or from two threads at once."""


class CaptureTimeoutError(DeviceError, TimeoutError):
    """Not every view arrived in time.

    Args:
        device: the camera.
        missing: views of which nothing usable came.
        timeout_s: how long it waited.
        unusable: what came and could not be used, by reason.
    """

    def __init__(
        self,
        device: str,
        *,
        missing: tuple[str, ...],
        timeout_s: float,
        unusable: Mapping[str, int] | None = None,
    ) -> None:
        came = ", ".join(f"{count} {reason}" for reason, count in (unusable or {}).items())
        super().__init__(
            device,
            f"asked for all views within {timeout_s:.2f} s, nothing "
            f"{f'usable ({came}) ' if came else ''}came from "
            f"{', '.join(missing)}",
            advice="check cable and power of these views, or raise camera.timeout_s",
        )
        self.missing = missing
        self.timeout_s = timeout_s


class ViewSkewError(DeviceError):
    """The views of one grab were exposed too far apart in time."""

    def __init__(self, device: str, *, skew_s: float, allowed_s: float) -> None:
        super().__init__(
            device,
            f"views {skew_s * 1e3:.2f} ms apart, allowed {allowed_s * 1e3:.2f} ms",
            advice="use hardware sync, or raise camera.max_skew_s for a static scene",
        )
        self.skew_s = skew_s
        self.allowed_s = allowed_s


class SceneMovedError(DeviceError):
    """The scene was not at rest while one camera moved from view to view.

    Args:
        device: the camera.
        symptom: what moved, and between which takes.
        advice: what to do next.
        region_px: left, top, right and bottom of what moved, in the reference view.
        picture: a picture that shows the region; empty where none is kept.
    """

    def __init__(
        self,
        device: str,
        symptom: str,
        *,
        advice: str = "",
        region_px: tuple[int, int, int, int],
        picture: str = "",
    ) -> None:
        super().__init__(device, symptom, advice=advice)
        self.region_px = region_px
        self.picture = picture


class ControlError(DeviceError):
    """A camera control was refused, clipped, or did not stay as it was set."""

    def __init__(
        self, device: str, *, control: str, wanted: str, applied: str, then: str = ""
    ) -> None:
        super().__init__(
            device,
            f"asked for {control} {wanted}, the camera applies {applied}",
            advice=then or "choose a value that the sensor can keep",
        )
        self.control = control
        self.wanted = wanted
        self.applied = applied


class StageLimitError(DeviceError, ValueError):
    """A move was refused because it leaves the travel; nothing moved."""

    def __init__(self, device: str, *, wanted_mm: float, travel_mm: tuple[float, float]) -> None:
        low_mm, high_mm = travel_mm
        super().__init__(
            device,
            f"asked for {wanted_mm:.3f} mm, travel is {low_mm:.3f}..{high_mm:.3f} mm",
            advice="choose distances inside the travel",
        )
        self.wanted_mm = wanted_mm
        self.travel_mm = travel_mm


class StageAlarmError(DeviceError):
    """The controller stopped or refused; the position must not be trusted until homed again."""

    def __init__(self, device: str, symptom: str, *, advice: str = "", code: str) -> None:
        super().__init__(device, symptom, advice=advice)
        self.code = code


class StageTimeoutError(DeviceError, TimeoutError):
    """The controller did not answer, or the move did not end, in time."""

    def __init__(self, device: str, symptom: str, *, advice: str = "", timeout_s: float) -> None:
        super().__init__(device, symptom, advice=advice)
        self.timeout_s = timeout_s


class StagePositionError(DeviceError):
    """The stage says it arrived, but the position read back is another one."""

    def __init__(
        self, device: str, *, wanted_mm: float, reached_mm: float, tolerance_mm: float
    ) -> None:
        super().__init__(
            device,
            f"sent to {wanted_mm:.3f} mm, reads {reached_mm:.3f} mm "
            f"(tolerance {tolerance_mm:.3f} mm)",
            advice="look for an obstacle or lost steps and home again",
        )
        self.wanted_mm = wanted_mm
        self.reached_mm = reached_mm
        self.tolerance_mm = tolerance_mm


class TargetError(RigError):
    """The calibration target could not be used; `reason` is one word for programs."""

    def __init__(self, found: str, *, advice: str = "", reason: str) -> None:
        super().__init__(found, advice=advice)
        self.reason = reason


class CalibrationError(RigError):
    """The sightings of the target do not determine the geometry of the rig."""


class SlopeError(RigError):
    """The images give no slope."""


class CurveError(RigError):
    """No depth-slope curve can be fitted, or the one at hand does not belong to this rig."""


class FormatError(RigError):
    """A file is not of the format it should be, or that format cannot hold what it is given.

    Args:
        found: see `RigError`; names the file and the place in it.
        advice: what to do where more is known than that this file cannot be read.
    """

    def __init__(
        self, found: str, *, advice: str = "give another file, or correct this one"
    ) -> None:
        super().__init__(found, advice=advice)


class OutputError(RigError):
    """What takes the frames of a capture (files, a page, topics) takes no more of them."""


class StoreError(RigError):
    """The database or the frame folders cannot be read or written."""


class OwnedError(StoreError):
    """Another program works on this sweep, album, folder or recording, or has taken it over."""
