"""The last thing that a run does with a stage when it ends early."""

from rig.devices import Stage
from rig.errors import DeviceError


def stopped(stage: Stage) -> str:
    """Stop the stage; say in words whether it stands still, and let the first error be the one."""
    try:
        stage.stop()
    except DeviceError as error:
        return str(error)
    return "the stage stands still"
