"""The table of the kinds that come with rig: by name, where each one is described.

This is the only list of them; every other one is derived from it. Nothing is imported before it is
asked for. Other people's kinds are no lines here but entry points of their packages.
"""

from collections.abc import Mapping

CAMERAS: Mapping[str, str] = {
    "sim": "rig_sim.kind:SIM",
    "folder": "rig_drivers.stored.kind:FOLDER",
    "recording": "rig_drivers.stored.kind:RECORDING",
    "oak": "rig_drivers.oak.kind:OAK",
    "v4l2": "rig_drivers.v4l2.kind:V4L2",
    "scan": "rig_drivers.scan.kind:SCAN",
    "lenslet": "rig_drivers.lenslet.kind:LENSLET",
}
"""By `camera.kind`: module and name of its `CameraKind`."""
STAGES: Mapping[str, str] = {
    "grbl": "rig_drivers.grbl.kind:GRBL",
    "zaber": "rig_drivers.zaber.kind:ZABER",
    "marlin": "rig_drivers.marlin.kind:MARLIN",
    "manual": "rig_drivers.manual.kind:MANUAL",
    "command": "rig_drivers.command.kind:COMMAND",
}
"""By `stage.kind`: module and name of its `StageKind`. The first one is what a new profile takes
where nothing tells the protocol; `rig_sim.firmware` has a package of the same name for each that
can be simulated."""
