"""What verbs look up in the database."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import RigError

if TYPE_CHECKING:
    from rig.curve import Curve
    from rig.database import StoredCalibration
    from rig.optics.rectifier import Rectifier
    from rig.profile import Profile


def find_rectifier(
    profile: "Profile", calibration: str | None, database: str | None
) -> "Rectifier":
    """Return the rectifier of the calibration asked for, or of the newest of the rig, if any.

    Raises:
        ConfigError: it is of another rig.
        StoreError: there is no such calibration.
    """
    from rig.calibrations import chosen_calibration
    from rig.database import open_store
    from rig.optics.rectifier import rectifier_of

    with open_store(database, absent="empty") as store:
        return rectifier_of(profile, chosen_calibration(store, profile.name, calibration))


def find_calibration(
    profile: "Profile", calibration: str | None, database: str | None
) -> "StoredCalibration | None":
    """Return the calibration asked for, or the newest of the rig; None where it has none.

    Raises:
        StoreError: there is no such calibration.
    """
    from rig.calibrations import chosen_calibration
    from rig.database import open_store

    with open_store(database, absent="empty") as store:
        return chosen_calibration(store, profile.name, calibration)


def find_curve(
    rectifier: "Rectifier", curve_id: int | None, database: str | None
) -> "tuple[int, Curve]":
    """Return the curve to use: the one asked for, or the newest of the rig.

    Raises:
        CurveError: it belongs to another rig, to another arrangement of its cameras, or to another
            calibration.
        StoreError: there is none.
    """
    from rig.capture.run import require_matching
    from rig.curve import Curve
    from rig.database import open_store
    from rig.sweep.conclude import stored_profile

    with open_store(database, absent="refused") as store:
        name = rectifier.profile.name
        stored = store.active_curve(name) if curve_id is None else store.curve(curve_id)
        calibrated = stored_profile(store.sweep(stored.sweep_id))
    require_matching(rectifier, calibrated, stored)
    return stored.id, Curve.from_json(stored.curve)


def curve_or_reason(rectifier: "Rectifier", database: str | None) -> "tuple[int, Curve] | RigError":
    """Return the newest curve of the rig, or why there is none to use."""
    try:
        return find_curve(rectifier, None, database)
    except RigError as error:
        return error


def new_folder(database: str | None, kind: str, rig: str) -> Path:
    """Name a folder beside the database for a run that nobody named, by rig and UTC time."""
    from rig.database import open_store

    with open_store(database, absent="empty") as store:
        beside = store.frames.parent
    return beside / kind / f"{rig}_{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
