"""Stored pictures in place of a profile's camera."""

from collections.abc import Sequence
from pathlib import Path

from rig.errors import OptionError
from rig.profile import FolderCameraConfig, PartConfig, Profile, V4l2CameraConfig
from rig.profile.parts import by_source

_VIDEOS = ("mp4", "avi", "mkv", "mov", "m4v", "webm")
_IMAGES = ("png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm")


def stored_pictures(profile: Profile, given: Sequence[str], root: Path) -> Profile:
    """Return the profile with stored pictures for a camera.

    Args:
        profile: the rig.
        given: one folder, in which every view is a video `VIEW.mp4`, a folder `VIEW` of images, or
            images whose names begin with the view's; or `VIEW=PATTERN` for every view. Views that
            name the same pictures are the parts of them that the profile says.
        root: where relative patterns start.

    Raises:
        ConfigError: a view is left out, unknown, or has nothing in the folder.
    """
    names = [view.name for view in profile.views]
    if len(given) == 1 and "=" not in given[0]:
        folder = Path(given[0]).expanduser().absolute()
        files = {name: _pattern(folder, name) for name in names}
    else:
        folder = root
        files = dict(_pair(text) for text in given)
        if set(files) != set(names):
            raise OptionError(
                f"--frames names {', '.join(sorted(files))}",
                advice=f"give one VIEW=PATTERN for each of {', '.join(names)}, or one folder",
            )
        files = {name: _below(folder, pattern) for name, pattern in files.items()}
        folder = Path(folder.anchor)
    camera = FolderCameraConfig(
        kind="folder", folder=str(folder), files=files, parts=_parts(profile, files)
    )
    return profile.model_copy(update={"camera": camera, "world": None})


def _parts(profile: Profile, files: dict[str, str]) -> dict[str, PartConfig]:
    """The profile's parts of those views that have their pictures in common with others."""
    camera = profile.camera
    known = camera.parts if isinstance(camera, FolderCameraConfig | V4l2CameraConfig) else {}
    common = {view for views in by_source(files).values() if len(views) > 1 for view in views}
    without = sorted(common - set(known))
    if without:
        raise OptionError(
            f"--frames names the same pictures for {', '.join(sorted(common))}, and profile "
            f"{profile.name} does not say where in them {', '.join(without)} lies",
            advice="give each view pictures of its own, or set camera.parts",
        )
    return {view: known[view] for view in common}


def _pair(text: str) -> tuple[str, str]:
    name, equals, pattern = text.partition("=")
    if not (equals and name and pattern):
        raise OptionError(
            f"--frames {text}: no view and pattern",
            advice="write VIEW=PATTERN, or one folder alone",
        )
    return name, pattern


def _below(folder: Path, pattern: str) -> str:
    """The pattern from the root of the file system, which the folder camera starts from."""
    path = (folder / Path(pattern).expanduser()).absolute()
    return path.relative_to(path.anchor).as_posix()


def _pattern(folder: Path, name: str) -> str:
    if not folder.is_dir():
        raise OptionError(f"--frames {folder}: no such folder", advice="correct the path")
    for pattern in (
        *(f"{name}.{suffix}" for suffix in _VIDEOS),
        *(f"{name}/*.{suffix}" for suffix in _IMAGES),
        *(f"{name}*.{suffix}" for suffix in _IMAGES),
        *(f"*/{name}.{suffix}" for suffix in _IMAGES),
    ):
        if next(folder.glob(pattern), None) is not None:
            return pattern
    raise OptionError(
        f"--frames {folder}: nothing for view {name}",
        advice=f"expected {name}.mp4, images in {name}/, or images {name}*.png; or "
        f"name them with --frames {name}=PATTERN",
    )
