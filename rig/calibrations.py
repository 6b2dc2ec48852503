"""Which calibration a run uses: the one asked for, none, or the newest good one of the rig."""

from rig.database import Store
from rig.errors import ConfigError
from rig.records import StoredCalibration

NO_CALIBRATION = "none"


def chosen_calibration(store: Store, rig: str, choice: str | None) -> StoredCalibration | None:
    """Return the calibration that a run is to use, None for pictures as they are.

    Args:
        store: where calibrations are.
        rig: name of the rig.
        choice: number of a calibration, `none`, or None for the newest active one, if any.

    Raises:
        ConfigError: the choice is neither.
        StoreError: no such calibration.
    """
    if choice is None:
        return store.active_calibration(rig)
    if choice == NO_CALIBRATION:
        return None
    if not choice.isdigit():
        raise ConfigError(
            f"--calibration {choice}: give the number of a calibration, or {NO_CALIBRATION}"
        )
    return store.calibration(int(choice))


def calibration_of(store: Store, calibration_id: int | None) -> StoredCalibration | None:
    """Return the calibration with a stored number, None for none.

    Raises:
        StoreError: no such calibration.
    """
    return None if calibration_id is None else store.calibration(calibration_id)
