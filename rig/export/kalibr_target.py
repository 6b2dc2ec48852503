"""Kalibr's target file (`--target` of its calibrators): which board, with lengths in m.

Types `aprilgrid`, `checkerboard` and `circlegrid`; of the last those with `asymmetricGrid`, whose
points are at ((2 column + row mod 2), row) times `spacingMeters`. Source: Kalibr wiki, "Calibration
targets", and its class GridCalibrationTargetCirclegrid. Kalibr passes by a field that it does not
know; here it is refused, for some programs that build on Kalibr mean another board by theirs.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from rig.errors import ConfigError, FormatError, OptionError
from rig.export import fields
from rig.profile import TargetConfig
from rig.profile.load import parse_target

_LARGEST_M = 5.0
"""Of one tag, square or step; a file that says more is written in mm."""
_TYPE = "target_type"

_Table = dict[str, object]


def read_target(path: Path, diameter_mm: float | None = None) -> TargetConfig:
    """Return the target that a file of Kalibr describes.

    Args:
        path: of the YAML file.
        diameter_mm: of a circle, which such a file does not tell; None for other targets.

    Raises:
        StoreError: it cannot be read.
        FormatError: it is none, lacks a field or has one that is not known, or describes a target
            that there is not: oblong squares, circles that are not shifted, lengths in mm.
        OptionError: a diameter is missing, or given for a target without circles.
    """
    found = fields.read_yaml(path)
    kind = fields.text(found, _TYPE, str(path))
    if kind not in _READERS:
        raise FormatError(
            f"{path}: {_TYPE} is {kind[:40]}, of Kalibr's there are {', '.join(_READERS)}",
            advice="write [target] by hand where the board is of another kind",
        )
    known, read = _READERS[kind]
    unknown = [name for name in found if name not in (_TYPE, *known)]
    if unknown:
        raise FormatError(
            f"{path}: {unknown[0][:40]} is no field of Kalibr's {kind}",
            advice=f"its fields are {', '.join(known)}; write [target] by hand for more",
        )
    table = read(found, str(path))
    if kind == "circlegrid":
        if diameter_mm is None:
            raise OptionError(
                f"{path}: tells no diameter of its circles, which corrects their middles",
                advice="measure one and give it: --diameter-mm",
            )
        table["diameter_mm"] = diameter_mm
    elif diameter_mm is not None:
        raise OptionError(
            f"asked for circles of {diameter_mm:g} mm, {path} describes a target of kind {kind}",
            advice="leave --diameter-mm out",
        )
    try:
        return parse_target(table, source=str(path))
    except ConfigError as error:
        raise FormatError(error.found, advice="correct this line of the file") from error


def _aprilgrid(found: fields.Fields, where: str) -> _Table:
    return {
        "kind": "aprilgrid",
        "tag_columns": _count(found, "tagCols", where),
        "tag_rows": _count(found, "tagRows", where),
        "tag_mm": _length_mm(found, "tagSize", where),
        "spacing": _number(found, "tagSpacing", where),
    }


def _checkerboard(found: fields.Fields, where: str) -> _Table:
    down_mm = _length_mm(found, "rowSpacingMeters", where)
    across_mm = _length_mm(found, "colSpacingMeters", where)
    if down_mm != across_mm:
        raise FormatError(
            f"{where}: its fields are {across_mm:g} mm wide and {down_mm:g} mm high",
            advice="measure again: a checkerboard here has squares",
        )
    return {
        "kind": "checkerboard",
        "columns": _count(found, "targetCols", where),
        "rows": _count(found, "targetRows", where),
        "square_mm": across_mm,
    }


def _circlegrid(found: fields.Fields, where: str) -> _Table:
    shifted = fields.field(found, "asymmetricGrid", where)
    if not isinstance(shifted, bool):
        raise FormatError(
            f"{where}: asymmetricGrid must be True or False", advice="correct this line of the file"
        )
    if not shifted:
        raise FormatError(
            f"{where}: its circles stand in a plain grid, which looks the same after half a turn",
            advice="print an asymmetric grid, or another target: rig target --kind ...",
        )
    return {
        "kind": "asymmetric_circles",
        "columns": _count(found, "targetCols", where),
        "rows": _count(found, "targetRows", where),
        "spacing_mm": _length_mm(found, "spacingMeters", where),
    }


_Reader = Callable[[fields.Fields, str], _Table]
_READERS: Mapping[str, tuple[tuple[str, ...], _Reader]] = {
    "aprilgrid": (("tagCols", "tagRows", "tagSize", "tagSpacing"), _aprilgrid),
    "checkerboard": (
        ("targetCols", "targetRows", "rowSpacingMeters", "colSpacingMeters"),
        _checkerboard,
    ),
    "circlegrid": (("targetCols", "targetRows", "spacingMeters", "asymmetricGrid"), _circlegrid),
}
"""By Kalibr's name: its fields, and what makes a table of them."""


def _number(found: fields.Fields, name: str, where: str) -> float:
    return fields.number(fields.field(found, name, where), f"{where}: {name}")


def _count(found: fields.Fields, name: str, where: str) -> int:
    count = _number(found, name, where)
    if not count.is_integer():
        raise FormatError(
            f"{where}: {name} is {count:g}, expected a whole number",
            advice="correct this line of the file",
        )
    return int(count)


def _length_mm(found: fields.Fields, name: str, where: str) -> float:
    length_m = _number(found, name, where)
    if not 0.0 < length_m <= _LARGEST_M:
        raise FormatError(
            f"{where}: {name} is {length_m:g} m, expected more than 0 and at most {_LARGEST_M:g} m",
            advice="Kalibr's lengths are in m: 0.088 is 88 mm",
        )
    return float(f"{1000.0 * length_m:.12g}")  # 29.9, not 29.900000000000002
