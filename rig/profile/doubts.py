"""What looks wrong in a profile before any hardware is asked."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.profile.cameras import FolderCameraConfig, RecordingCameraConfig
from rig.profile.models import Profile
from rig.profile.targets import (
    AprilGridConfig,
    AsymmetricCirclesConfig,
    CharucoConfig,
    CheckerboardConfig,
    TargetConfig,
)

LEAST_SQUARE_MM = 0.5
"""Smaller squares are a length in metres: 0.025 for 25 mm."""
LEAST_PITCH_MM = 0.2
LEAST_DISTANCE_MM = 10.0
PLACEHOLDER = "REPLACE-BY-YOURS"

_GUESS = re.compile(r"#\s*measure\b|#.*\bMEASURE\b")
_LEGEND = "lines that say MEASURE"


@dataclass(frozen=True, slots=True)
class Doubt:
    """One value that a rig can hardly have."""

    key: str
    found: str
    advice: str

    def __str__(self) -> str:
        """Return one line."""
        return f"{self.key}: {self.found}; {self.advice}"


def doubts(profile: Profile, text: str) -> tuple[Doubt, ...]:
    """Return what looks wrong.

    Args:
        profile: the rig.
        text: its file, whose comments say which values are guesses.
    """
    return (
        *_plan(profile),
        *_lengths(profile),
        *_files(profile),
        *_placeholders("", profile.model_dump(mode="json")),
        *_guesses(text),
    )


def _plan(profile: Profile) -> Iterator[Doubt]:
    if profile.sweep is None or profile.stage is None:
        return
    near_mm, far_mm = profile.stage.travel_mm
    for key in ("from_mm", "to_mm"):
        distance_mm = getattr(profile.sweep, key)
        if not near_mm <= distance_mm <= far_mm:
            yield Doubt(
                f"sweep.{key}",
                f"{distance_mm:g} mm is outside stage.travel_mm, {near_mm:g}..{far_mm:g} mm",
                "choose distances inside the travel",
            )
    if profile.sweep.from_mm == profile.sweep.to_mm:
        yield Doubt(
            "sweep.to_mm",
            f"{profile.sweep.to_mm:g} mm is also sweep.from_mm",
            "a curve needs different distances",
        )


def _lengths(profile: Profile) -> Iterator[Doubt]:
    lengths_mm = [("pitch_mm", profile.pitch_mm, LEAST_PITCH_MM)]
    if profile.target is not None:
        key, length_mm = _length_of(profile.target)
        lengths_mm.append((f"target.{key}", length_mm, LEAST_SQUARE_MM))
    if profile.sweep is not None:
        lengths_mm.append(("sweep.to_mm", profile.sweep.to_mm, LEAST_DISTANCE_MM))
    for key, length_mm, least_mm in lengths_mm:
        if length_mm < least_mm:
            yield Doubt(
                key,
                f"{length_mm:g} mm, less than {least_mm:g} mm",
                f"lengths are in mm: write {1e3 * length_mm:g} if these are metres",
            )


def _length_of(target: TargetConfig) -> tuple[str, float]:
    """The length by which a target is measured, and its key."""
    match target:
        case CheckerboardConfig() | CharucoConfig():
            return "square_mm", target.square_mm
        case AprilGridConfig():
            return "tag_mm", target.tag_mm
        case AsymmetricCirclesConfig():
            return "spacing_mm", target.spacing_mm


def _files(profile: Profile) -> Iterator[Doubt]:
    camera = profile.camera
    if isinstance(camera, RecordingCameraConfig) and not Path(camera.file).is_file():
        yield Doubt("camera.file", f"{camera.file} is no file", "name the recording")
    if not isinstance(camera, FolderCameraConfig):
        return
    folder = Path(camera.folder)
    if not folder.is_dir():
        yield Doubt("camera.folder", f"{folder} is no folder", "say where the images are")
        return
    for view, pattern in camera.files.items():
        if not any(folder.glob(pattern)):
            yield Doubt(f"camera.files.{view}", f"no {pattern} in {folder}", "name its images")


def _placeholders(path: str, value: object) -> Iterator[Doubt]:
    if isinstance(value, str) and PLACEHOLDER in value:
        yield Doubt(path, f"{value} is a placeholder", "rig devices shows what is plugged in")
    elif isinstance(value, Mapping):
        for key, entry in value.items():
            yield from _placeholders(f"{path}.{key}" if path else str(key), entry)
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for number, entry in enumerate(value):
            yield from _placeholders(f"{path}.{number}", entry)


def _guesses(text: str) -> Iterator[Doubt]:
    numbers = [
        str(number)
        for number, line in enumerate(text.splitlines(), start=1)
        if _GUESS.search(line) and _LEGEND not in line
    ]
    if numbers:
        yield Doubt(
            f"line{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}",
            "MEASURE stands there",
            "measure these values, then take the word out",
        )
