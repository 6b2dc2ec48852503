"""One device of a simulated Zaber chain: commands in, answers out."""

from collections.abc import Sequence

from rig_sim.firmware.zaber.axis import Axis
from rig_sim.firmware.zaber.messages import Command

NONE = "0"
DRIVER = "driver"
BAD_AXIS = "BADAXIS"
BAD_COMMAND = "BADCOMMAND"
BAD_DATA = "BADDATA"
DRIVER_DISABLED = "DRIVERDISABLED"


class RejectedError(Exception):
    """A command that the device does not take; carries the reason."""


class Device:
    """Settings and axes behind one address."""

    def __init__(
        self,
        address: int,
        axes: Sequence[Axis],
        values: dict[str, str],
        lacks: Sequence[str] = (),
    ) -> None:
        self.axes = tuple(axes)
        self._lacks = frozenset(lacks)
        self._fixed = {**values, "system.axiscount": str(len(axes))}
        self.settings = {"comm.address": str(address), "comm.alert": "0", "comm.checksum": "1"}

    @property
    def address(self) -> int:
        """Its number in the chain."""
        return int(self.settings["comm.address"])

    def execute(self, command: Command) -> tuple[bool, str]:
        """Return whether a command is taken, and the data of the answer."""
        try:
            axes = self._addressed(command.axis)
            return True, self._execute(command, axes)
        except RejectedError as reason:
            return False, str(reason)

    def _addressed(self, axis: int) -> tuple[Axis, ...]:
        if axis > len(self.axes):
            raise RejectedError(BAD_AXIS)
        return self.axes[axis - 1 : axis] if axis else self.axes

    def _execute(self, command: Command, axes: tuple[Axis, ...]) -> str:
        match command.words:
            case ():
                return NONE
            case ("get", name):
                return self._get(name, axes, whole=command.axis == 0)
            case ("set", name, value):
                return self._set(name, value, axes)
            case ("warnings", *rest):
                return self._warnings(rest, axes)
            case _:
                return self._act(command.words, axes)

    def _act(self, words: Sequence[str], axes: tuple[Axis, ...]) -> str:
        match words:
            case ("driver", *_) if DRIVER in self._lacks:
                raise RejectedError(BAD_COMMAND)
            case ("driver", "enable" | "disable" as wish):
                for axis in axes:
                    self._switch_driver(axis, on=wish == "enable")
            case ("stop" | "estop" as wish,):
                for axis in axes:
                    (axis.stop if wish == "stop" else axis.stop_dead)()
            case ("home",):
                for axis in self._powered(axes):
                    axis.home()
            case ("move", *rest):
                for axis in self._powered(axes):
                    self._move(rest, axis)
            case _:
                raise RejectedError(BAD_COMMAND)
        return NONE

    def _get(self, name: str, axes: tuple[Axis, ...], *, whole: bool) -> str:
        if name in self._lacks:
            raise RejectedError(BAD_COMMAND)
        if name in self._fixed or name in self.settings:
            return (self._fixed | self.settings)[name]
        if name == "pos":
            return " ".join(str(axis.position) for axis in axes)
        if name not in axes[0].values:
            raise RejectedError(BAD_COMMAND)
        return " ".join(f"{axis.values[name]:g}" for axis in (axes if whole else axes[:1]))

    def _set(self, name: str, text: str, axes: tuple[Axis, ...]) -> str:
        value = _number(text)
        if name in self.settings:
            self.settings[name] = f"{value:.0f}"
        elif name == "pos":
            for axis in axes:
                axis.steppers.set_counted(value / axis.steps_per_unit_mm)
        elif name in axes[0].values:
            for axis in axes:
                axis.values[name] = value
        else:
            raise RejectedError(BAD_COMMAND)
        return NONE

    def _warnings(self, rest: Sequence[str], axes: tuple[Axis, ...]) -> str:
        flags = [flag for axis in axes for flag in axis.sorted_flags()]
        if rest == ["clear"]:
            for axis in axes:
                axis.flags -= {"FS", "NI", "WS", "WL", "WM"}
        elif rest:
            raise RejectedError(BAD_COMMAND)
        return " ".join((f"{len(flags):02d}", *flags))

    def _switch_driver(self, axis: Axis, *, on: bool) -> None:
        if on:
            axis.flags.discard("FO")
        else:
            axis.stop_dead()
            axis.flags |= {"FO", "WR"}

    def _powered(self, axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
        if DRIVER in self._lacks:  # such a firmware switches the motor on for every motion
            for axis in axes:
                axis.flags -= {"FO", "FD"}
        if any("FO" in axis.flags for axis in axes):
            raise RejectedError(DRIVER_DISABLED)
        return axes

    def _move(self, words: Sequence[str], axis: Axis) -> None:
        match words:
            case ("abs", to, *how):
                position = round(_number(to))
            case ("rel", way, *how):
                position = axis.position + round(_number(way))
            case ("min" | "max" as end, *how):
                position = round(axis.values[f"limit.{end}"])
            case ("vel", velocity):
                position = round(axis.values["limit.max" if _number(velocity) > 0 else "limit.min"])
                how = [f"{abs(_number(velocity)):.0f}"]
            case _:
                raise RejectedError(BAD_COMMAND)
        speed = _number(how[0]) if how else None
        if speed is not None and not 0.0 < speed <= axis.values["maxspeed"]:
            raise RejectedError(BAD_DATA)
        if not axis.move_to(position, speed):
            raise RejectedError(BAD_DATA)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise RejectedError(BAD_DATA) from error
