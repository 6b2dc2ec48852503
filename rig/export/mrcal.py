"""mrcal `.cameramodel`: one file per view, a Python literal with comments.

Lengths in m; `extrinsics` is `rt_fromref`, a Rodrigues vector and a translation that take points of
the common reference frame into the camera. Lens models LENSMODEL_PINHOLE, OPENCV4, OPENCV5,
OPENCV8, and OPENCV12 without thin prism. Format: mrcal documentation, "cameramodel file formats".
"""

import ast
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from rig.bounded_text import read_text
from rig.errors import FormatError
from rig.export import fields
from rig.export.geometry_format import GeometryExport, GeometryFormat
from rig.export.opencv_lens import opencv_lens
from rig.export.seen_from_one import seen_from_one
from rig.files import write_bytes
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

SUFFIX = ".cameramodel"

_MOST_ENTRIES = 20_000
"""A splined model has some thousands."""
_MOST_BYTES = 16_000_000
"""Most of it what the model was solved from, as one literal of bytes."""
_BYTES = re.compile(r"b'[^'\\\n]*'")
_MODEL_OF: dict[LensModel, str] = {
    "none": "LENSMODEL_PINHOLE",
    "brown5": "LENSMODEL_OPENCV5",
    "brown8": "LENSMODEL_OPENCV8",
}
_LENSES: dict[str, tuple[LensModel, int]] = {
    "LENSMODEL_PINHOLE": ("none", 0),
    "LENSMODEL_OPENCV4": ("brown5", 4),
    "LENSMODEL_OPENCV5": ("brown5", 5),
    "LENSMODEL_OPENCV8": ("brown8", 8),
    "LENSMODEL_OPENCV12": ("brown8", 12),
}


def write(geometry: RigGeometry, folder: Path) -> None:
    """Write one file per view, `NAME.cameramodel`.

    Raises:
        FormatError: a view has a fisheye lens, which mrcal does not know.
        StoreError: a file cannot be written.
    """
    for name, camera, pose in zip(
        geometry.names, geometry.cameras, geometry.cam_from_reference, strict=True
    ):
        if camera.lens not in _MODEL_OF:
            raise FormatError(
                f"view {name}: mrcal has no {camera.lens} lens of this kind",
                advice="calibrate with a Brown-Conrady lens, or fit one with --refit",
            )
        intrinsics = [
            camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.coefficients,
        ]  # fmt: skip
        extrinsics = [*pose.rotation_rad.tolist(), *(pose.translation_mm / 1000.0).tolist()]
        lines = (
            "{",
            f"    'lensmodel':  '{_MODEL_OF[camera.lens]}',",
            "    # fx, fy, cx, cy in px, then the lens",
            f"    'intrinsics': {[float(n) for n in intrinsics]},",
            "    # Rodrigues vector (rad) and translation (m) from the reference frame",
            f"    'extrinsics': {[float(n) for n in extrinsics]},",
            f"    'imagersize': [{camera.width_px}, {camera.height_px}],",
            "}",
            "",
        )
        write_bytes(folder / f"{name}{SUFFIX}", "\n".join(lines).encode())


def read(folder: Path) -> RigGeometry:
    """Read all `*.cameramodel` of a folder, or one file; views are called after their files.

    The first view at the reference frame's origin is the reference, else the first by name.

    Raises:
        FormatError: there is none, or one is not as it should be.
        StoreError: a file cannot be read.
    """
    paths = [folder] if folder.is_file() else sorted(folder.glob(f"*{SUFFIX}"))
    if not paths:
        raise FormatError(
            f"{folder}: holds no *{SUFFIX}", advice="give the folder with one per view"
        )
    read_all = [_read_one(path) for path in paths]
    return seen_from_one(
        [path.name.removesuffix(SUFFIX) for path in paths],
        [camera for camera, _ in read_all],
        [pose for _, pose in read_all],
    )


def _read_one(path: Path) -> tuple[CameraModel, Pose]:
    where = str(path)
    text = _BYTES.sub("b''", read_text(path, _MOST_BYTES)).strip()
    if text.count(",") > _MOST_ENTRIES:  # the parser takes half a kilobyte for each
        raise FormatError(f"{path}: has more than {_MOST_ENTRIES} entries, no camera model has")
    try:
        with warnings.catch_warnings(action="error"):  # the parser's own words to a programmer
            # A literal only: nothing of the file is ever run.
            content = ast.literal_eval(text)
    except (
        SyntaxWarning,
        ValueError,
        SyntaxError,
        TypeError,
        MemoryError,
        RecursionError,
    ) as error:
        raise FormatError(
            f"{path}: is no mrcal camera model ({error.__class__.__name__})",
            advice="give a .cameramodel file as mrcal wrote it; it converts others with "
            "mrcal-to-cameramodel",
        ) from error
    entry = fields.mapping(content, where)
    model = fields.text(entry, "lensmodel", where)
    if model not in _LENSES:
        raise FormatError(
            f"{path}: lens model {model} is not known here",
            advice=f"convert it: mrcal-convert-lensmodel LENSMODEL_OPENCV8 {path.name}; read are "
            f"{', '.join(_LENSES)}",
        )
    lens, count = _LENSES[model]
    numbers = fields.numbers(
        fields.field(entry, "intrinsics", where), f"{where} intrinsics", count=4 + count
    )
    coefficients = numbers[4:]
    if count:
        lens, coefficients = opencv_lens(coefficients, f"{where} {model}")
    size = fields.numbers(fields.field(entry, "imagersize", where), where, count=2)
    width, height = (fields.size_px(n, f"{where} imagersize") for n in size)
    # Newer versions call the same numbers rt_cam_ref.
    key = "extrinsics" if "extrinsics" in entry else "rt_cam_ref"
    rt = fields.numbers(fields.field(entry, key, where), f"{where} {key}", count=6)
    pose = fields.turned(rt[:3], [1000.0 * length for length in rt[3:]], f"{where} {key}")
    return fields.camera(
        (width, height), fields.four(numbers[:4], where), lens, coefficients, where
    ), pose


@dataclass(frozen=True, slots=True)
class MrcalExport(GeometryExport):
    """Writes a calibration for mrcal camera models."""

    format: ClassVar = GeometryFormat(
        "mrcal",
        "mrcal camera models",
        "",
        ("none", "brown5", "brown8"),
        write,
        read,
        comments=(f"{{view}}{SUFFIX}",),
    )
