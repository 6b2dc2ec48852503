"""Sweeps, samples, slopes and curves: a database for the numbers, folders for the frames."""

from rig.database.provenance import software_versions, this_program
from rig.database.store import Store, open_store

__all__ = ["Store", "open_store", "software_versions", "this_program"]
