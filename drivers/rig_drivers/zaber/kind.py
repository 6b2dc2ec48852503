"""The Zaber ASCII protocol as a kind of stage."""

from rig.devices import Stage
from rig.profile import ZaberStageConfig
from rig.profile.kinds import StageKind, StageTemplate, Surroundings
from rig_drivers.stage.kind import SERIAL_PORTS, serial_section

_HEAD = """\
# Zaber ASCII protocol; the port is that of the first device of the chain.
[stage]
kind = "zaber"
device_address = 1
axis_number = 1
microstep_mm = 0.00049609375  # MEASURE, or see the data sheet: way of one microstep
"""


def _open(config: ZaberStageConfig, around: Surroundings) -> Stage:
    from rig_drivers.zaber.controller import zaber_stage

    return zaber_stage(config, around.clock)


ZABER = StageKind(
    contract=1,
    name="zaber",
    config=ZaberStageConfig,
    open=_open,
    search=SERIAL_PORTS,
    template=StageTemplate(lambda new: serial_section(_HEAD, new), adapter="zaber"),
)
