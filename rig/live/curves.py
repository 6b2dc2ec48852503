"""`rig.load_curve`: a depth-slope curve from the database or from a file."""

import json
import os
from pathlib import Path
from typing import Any, cast

from rig.calibration_alone import curve_alone
from rig.curve import Curve
from rig.errors import CurveError
from rig.files import read_bytes
from rig.stored import run_with, stored_profile


def load_curve(which: int | str | os.PathLike[str], *, database: str | None = None) -> Curve:
    """Return a depth-slope curve.

    Args:
        which: number of a stored curve; name of a rig, for its newest good one, or, where it has
            none at all, for that of its calibration alone; or the path of a JSON file (a `Path`, or
            text that ends in `.json`) that holds what `Curve.to_json` gave.
        database: SQLAlchemy URL; None for `RIG_DATABASE`, else the user's own.

    Raises:
        ConfigError: the calibration was stored by another version.
        CurveError: the file holds no curve, or the calibration knows no depth.
        StoreError: no such database, curve or file.
    """
    if not isinstance(which, int) and not _is_name(which):
        return _from_file(Path(which))
    from rig.database import open_store

    with open_store(database, absent="refused") as store:
        if isinstance(which, int):
            return Curve.from_json(store.curve(which).curve)
        name = os.fspath(which)
        calibration = None if store.has_curve(name) else store.active_calibration(name)
        if calibration is None:
            return Curve.from_json(store.active_curve(name).curve)
        return curve_alone(run_with(store, stored_profile(calibration), calibration.id)).curve


def _is_name(which: str | os.PathLike[str]) -> bool:
    return isinstance(which, str) and not which.endswith(".json")


def _from_file(path: Path) -> Curve:
    try:
        content = json.loads(read_bytes(path))
    except ValueError as error:
        raise CurveError(
            f"{path}: is no JSON ({error})", advice="write it with json.dumps(curve.to_json())"
        ) from error
    if not isinstance(content, dict):
        raise CurveError(
            f"{path}: holds no curve, found {type(content).__name__}",
            advice="write it with json.dumps(curve.to_json())",
        )
    return Curve.from_json(cast("dict[str, Any]", content))
