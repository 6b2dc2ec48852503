"""A hand as a kind of stage."""

from rig.devices import Stage
from rig.profile import ManualStageConfig
from rig.profile.kinds import NewStage, StageKind, StageTemplate, Surroundings

_SECTION = """\
# No stage: rig says where the board belongs, somebody puts it there and presses Enter.
[stage]
kind = "manual"
travel_mm = [{near_mm}, {far_mm}]  # MEASURE: nearest and farthest distance, lens centre to board
reading_sigma_mm = 0.5       # MEASURE: how well the distance is read and kept, 1 sigma
tolerance_mm = 5.0           # a typed reading may be so far from what was asked for
may_move = false             # true when the lines above are MEASURED
"""


def _open(config: ManualStageConfig, around: Surroundings) -> Stage:
    from rig_drivers.manual.beside import Beside
    from rig_drivers.manual.stage import ManualStage
    from rig_drivers.manual.terminal import Terminal

    terminal = Terminal("stage")
    person = terminal if around.bystander is None else Beside(terminal, around.bystander)
    return ManualStage(config, around.clock, person)


def _section(new: NewStage) -> str:
    return _SECTION.format(near_mm=new.near_mm, far_mm=new.far_mm)


MANUAL = StageKind(
    contract=1,
    name="manual",
    config=ManualStageConfig,
    open=_open,
    template=StageTemplate(_section),
)
