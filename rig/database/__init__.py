"""Sweeps, samples, slopes and curves: a database for the numbers, folders for the frames."""

from rig.database.provenance import software_versions
from rig.database.store import Store, open_store
from rig.measurement import Failure, Measurement
from rig.records import (
    HistoryRow,
    Json,
    Sample,
    SampleKey,
    State,
    StoredCalibration,
    StoredCurve,
    StoredFrame,
    Sweep,
)

__all__ = [
    "Failure",
    "HistoryRow",
    "Json",
    "Measurement",
    "Sample",
    "SampleKey",
    "State",
    "Store",
    "StoredCalibration",
    "StoredCurve",
    "StoredFrame",
    "Sweep",
    "open_store",
    "software_versions",
]
