"""GRBL 1.1, grblHAL and FluidNC as a kind of stage."""

from rig.devices import Stage
from rig.profile import GrblStageConfig
from rig.profile.kinds import StageKind, StageTemplate, Surroundings
from rig_drivers.stage.kind import SERIAL_PORTS, serial_section

_HEAD = """\
# GRBL 1.1, grblHAL, FluidNC: $22=1 (homing), $20=1 (soft limits), $130 (travel) must be set.
[stage]
kind = "grbl"
axis = "X"
"""


def _open(config: GrblStageConfig, around: Surroundings) -> Stage:
    from rig_drivers.grbl.controller import grbl_stage

    return grbl_stage(config, around.clock)


GRBL = StageKind(
    contract=1,
    name="grbl",
    config=GrblStageConfig,
    open=_open,
    search=SERIAL_PORTS,
    template=StageTemplate(lambda new: serial_section(_HEAD, new)),
)
