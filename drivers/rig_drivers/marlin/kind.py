"""Marlin 2 as a kind of stage."""

from rig.devices import Stage
from rig.profile import MarlinStageConfig
from rig.profile.kinds import StageKind, StageTemplate, Surroundings
from rig_drivers.stage.kind import SERIAL_PORTS, serial_section

_HEAD = """\
# Marlin 2 (the board of a 3D printer): homes with G28.
[stage]
kind = "marlin"
axis = "X"
"""


def _open(config: MarlinStageConfig, around: Surroundings) -> Stage:
    from rig_drivers.marlin.controller import marlin_stage

    return marlin_stage(config, around.clock)


MARLIN = StageKind(
    contract=1,
    name="marlin",
    config=MarlinStageConfig,
    open=_open,
    search=SERIAL_PORTS,
    template=StageTemplate(lambda new: serial_section(_HEAD, new)),
)
