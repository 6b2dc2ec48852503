"""A program of the user's own as a kind of stage."""

from rig.devices import Stage
from rig.profile import CommandStageConfig
from rig.profile.kinds import NewStage, StageKind, StageTemplate, Surroundings

_SECTION = """\
# Your own program moves the stage: it is run with `move MM`, `position` or `stop` as last arguments
# and answers each with one line of JSON; see docs/how-to/command-stage.md.
[stage]
kind = "command"
command = ["python3", "/path/to/REPLACE-BY-YOURS.py"]
travel_mm = [{near_mm}, {far_mm}]  # MEASURE: nearest and farthest distance, lens centre to board
speed_mm_s = 50.0            # with acceleration_mm_s2 only for estimates of time
approach_mm = 2.0            # more than the play of the spindle
may_move = false             # true when the lines above are MEASURED and the way is clear
"""


def _open(config: CommandStageConfig, around: Surroundings) -> Stage:
    from rig_drivers.command.program import CommandProgram
    from rig_drivers.command.stage import CommandStage

    return CommandStage(config, around.clock, CommandProgram(config.command, "stage"))


def _section(new: NewStage) -> str:
    return _SECTION.format(near_mm=new.near_mm, far_mm=new.far_mm)


COMMAND = StageKind(
    contract=1,
    name="command",
    config=CommandStageConfig,
    open=_open,
    template=StageTemplate(_section),
)
