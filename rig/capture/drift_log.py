"""The looks beside a capture as a series that others may read at any time."""

from rig.database import Store
from rig.drift_series import DriftSeries, drift_series
from rig.records import StoredCalibration, StoredDrift


class DriftLog:
    """Looks of one rig at scenes, since its calibration; empty until it is begun.

    Earlier looks are read only where somebody shows them. One thread adds; whoever reads gets a
    series that does not change any more.
    """

    def __init__(self) -> None:
        self._is_shown = False
        self._series: DriftSeries | None = None

    def show(self) -> None:
        """Say that somebody shows the series; before it is begun."""
        self._is_shown = True

    @property
    def series(self) -> DriftSeries | None:
        """What is known so far; None where nothing is compared with a calibration."""
        return self._series

    def begin(self, calibration: StoredCalibration, store: Store, unit: str) -> None:
        """Take what earlier looks told of this calibration.

        Args:
            calibration: of the capture.
            store: where looks are kept.
            unit: which of the rigs of its name.
        """
        if not self._is_shown:
            return
        earlier = (look for look in store.drifts(calibration.rig) if look.unit == unit)
        self._series = drift_series(calibration, earlier)

    def add(self, look: StoredDrift) -> None:
        """Take one more look."""
        if self._series is not None:
            self._series = self._series.joined(look)
