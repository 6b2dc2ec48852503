"""Controls of a node by name: what there is, its limits, and values set, read back and compared."""

import ctypes
import difflib
import errno
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from rig.errors import ConfigError, DeviceLostError
from rig_drivers.v4l2 import abi, structures
from rig_drivers.v4l2.node import Node

ControlValue = int | bool | str
"""A number, a switch, or the name of a menu entry."""

_NUMBERS = (
    abi.CTRL_TYPE_INTEGER,
    abi.CTRL_TYPE_BOOLEAN,
    abi.CTRL_TYPE_MENU,
    abi.CTRL_TYPE_INTEGER64,
    abi.CTRL_TYPE_BITMASK,
    abi.CTRL_TYPE_INTEGER_MENU,
)
_MENUS = (abi.CTRL_TYPE_MENU, abi.CTRL_TYPE_INTEGER_MENU)
_SETTABLE = (*_NUMBERS, abi.CTRL_TYPE_BUTTON)


@dataclass(frozen=True, slots=True)
class Control:
    """One control of a node, as the driver describes it."""

    number: int
    """The kernel's id."""
    name: str
    """Lower case with underscores, as `v4l2-ctl` shows it."""
    kind: int
    least: int
    most: int
    step: int
    default: int
    flags: int
    menu: Mapping[int, str] = field(default_factory=dict[int, str])
    """Names of the entries of a menu, by value."""

    @property
    def is_active(self) -> bool:
        """False where another control, such as an automatism, has taken over."""
        return not self.flags & abi.CTRL_FLAG_INACTIVE

    @property
    def limits(self) -> str:
        """What may be set, for messages."""
        if self.menu:
            return ", ".join(f"{value} ({name})" for value, name in self.menu.items())
        if self.kind == abi.CTRL_TYPE_BOOLEAN:
            return "true, false"
        if self.kind == abi.CTRL_TYPE_BITMASK:
            return f"bits of {self.most & 0xFFFF_FFFF:#x}"
        step = f" in steps of {self.step}" if self.step > 1 else ""
        return f"{self.least}..{self.most}{step}"

    def number_of(self, value: ControlValue) -> int:
        """Return what the driver has to be told.

        Raises:
            ConfigError: the value is of another type or outside the limits.
        """
        if isinstance(value, str):
            wanted = _plain(value)
            found = [key for key, name in self.menu.items() if _plain(name) == wanted]
            if not found:
                raise self._refusal(value)
            return found[0]
        if self.kind == abi.CTRL_TYPE_BUTTON:
            return 0  # to set it is to press it
        number = int(value)
        if self.kind == abi.CTRL_TYPE_BITMASK:
            fits = number >= 0 and not number & ~(self.most & 0xFFFF_FFFF)
        elif self.menu:
            fits = number in self.menu
        else:
            fits = self.least <= number <= self.most
            fits = fits and (number - self.least) % max(1, self.step) == 0
        if not fits:
            raise self._refusal(value)
        return number

    def _refusal(self, value: ControlValue) -> ConfigError:
        return ConfigError(
            f"control {self.name}: asked for {value}, may be {self.limits}",
            advice="correct it in camera.controls",
        )


class Controls:
    """All numeric controls of an open node; what they are is asked once."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._by_name = {control.name: control for control in _listed(node)}

    def __iter__(self) -> Iterator[Control]:
        return iter(self._by_name.values())

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def named(self, name: str) -> Control:
        """Return a control by its name.

        Raises:
            ConfigError: the camera has none of that name; names the nearest one, or all.
        """
        if name in self._by_name:
            return self._by_name[name]
        near = difflib.get_close_matches(name, self._by_name, n=1, cutoff=0.6)
        listed = ", ".join(sorted(self._by_name)) or "none at all"
        hint = f"did you mean {near[0]}?" if near else f"it has {listed}"
        raise ConfigError(f"{self._node.name}: has no control {name}", advice=hint)

    def with_number(self, number: int) -> Control | None:
        """Return a control by the kernel's id; None if the camera has none."""
        return next((c for c in self._by_name.values() if c.number == number), None)

    def read(self, control: Control) -> int:
        """Return the value of a control.

        Raises:
            DeviceLostError: the camera is gone or does not tell.
        """
        try:
            return _call(self._node, abi.VIDIOC_G_EXT_CTRLS, control)
        except OSError as error:
            raise DeviceLostError(
                self._node.name,
                f"does not tell control {control.name}: {error.strerror}",
                advice="plug it in again",
            ) from error

    def apply(self, values: Mapping[str, ControlValue]) -> dict[str, int]:
        """Set controls in the order given, then read all of them back.

        Switch an automatism off before the value that it rules.

        Returns:
            what each control reads after all were set.

        Raises:
            ConfigError: a control is absent, inactive or read-only, a value is outside the limits,
                or the device changed it.
            DeviceLostError: the camera is gone, or refuses a value within its own limits.
        """
        asked = {name: self._set(name, value) for name, value in values.items()}
        found: dict[str, int] = {}
        for name, number in asked.items():
            control = self._by_name[name]
            if control.kind == abi.CTRL_TYPE_BUTTON or control.flags & abi.CTRL_FLAG_WRITE_ONLY:
                continue
            found[name] = self.read(control)
            if found[name] != number:
                raise ConfigError(
                    f"{self._node.name}: control {name} was set to {number}, reads {found[name]} "
                    f"(may be {control.limits})",
                    advice="another control rules it, or the device rounds",
                )
        return found

    def _set(self, name: str, value: ControlValue) -> int:
        control = self._current(self.named(name))
        where = f"{self._node.name}: control {name}"
        if control.flags & abi.CTRL_FLAG_READ_ONLY:
            raise ConfigError(f"{where} can only be read", advice="remove it from camera.controls")
        try:
            number = control.number_of(value)
        except ConfigError as error:
            raise ConfigError(f"{self._node.name}: {error.found}", advice=error.advice) from error
        if not control.is_active:
            raise ConfigError(
                f"{where} is inactive: an automatism rules it",
                advice="switch that off in camera.controls, above this one",
            )
        try:
            _call(self._node, abi.VIDIOC_S_EXT_CTRLS, control, number)
        except OSError as error:
            if error.errno in (errno.ERANGE, errno.EINVAL):
                raise ConfigError(
                    f"{where}: asked for {value}, refused ({error.strerror})",
                    advice=f"may be {control.limits}",
                ) from error
            raise DeviceLostError(
                self._node.name,
                f"{where}: {error.strerror}",
                advice="plug it in again, or remove it from camera.controls",
            ) from error
        return number

    def _current(self, control: Control) -> Control:
        """Ask again: limits and activity change with other controls."""
        described = _query(self._node, control.number)
        if described is None:
            return control
        self._by_name[control.name] = described
        return described


def _listed(node: Node) -> Iterator[Control]:
    number = 0
    while True:
        raw = structures.QueryExtendedControl(id=number | abi.CTRL_FLAG_NEXT)
        try:
            node.ioctl(abi.VIDIOC_QUERY_EXT_CTRL, raw)
        except OSError as error:
            if error.errno in (errno.EINVAL, errno.ENOTTY):
                return
            raise
        if raw.id <= number:
            return  # a driver that does not move on
        number = raw.id
        if raw.type in _SETTABLE and not raw.flags & (
            abi.CTRL_FLAG_DISABLED | abi.CTRL_FLAG_HAS_PAYLOAD
        ):
            yield _described(node, raw)


def _query(node: Node, number: int) -> Control | None:
    raw = structures.QueryExtendedControl(id=number)
    try:
        node.ioctl(abi.VIDIOC_QUERY_EXT_CTRL, raw)
    except OSError:
        return None
    return _described(node, raw)


def _described(node: Node, raw: structures.QueryExtendedControl) -> Control:
    return Control(
        number=raw.id,
        name=control_name(raw.name),
        kind=raw.type,
        least=raw.minimum,
        most=raw.maximum,
        step=raw.step,
        default=raw.default_value,
        flags=raw.flags,
        menu=dict(_menu(node, raw)) if raw.type in _MENUS else {},
    )


def _menu(node: Node, raw: structures.QueryExtendedControl) -> Iterator[tuple[int, str]]:
    for index in range(raw.minimum, min(raw.maximum, raw.minimum + 255) + 1):
        entry = structures.QueryMenu(id=raw.id, index=index)
        try:
            node.ioctl(abi.VIDIOC_QUERYMENU, entry)
        except OSError as error:
            if error.errno == errno.EINVAL:
                continue  # menus may have holes
            raise
        if raw.type == abi.CTRL_TYPE_INTEGER_MENU:
            content = ctypes.string_at(
                ctypes.addressof(entry) + structures.QueryMenu.name.offset, 8
            )
            yield index, str(int.from_bytes(content, "little", signed=True))
        else:
            yield index, entry.name.decode(errors="replace")


def _call(node: Node, request: int, control: Control, number: int = 0) -> int:
    value = structures.ExtendedControl(id=control.number, value64=number)
    call = structures.ExtendedControls(
        which=abi.CTRL_WHICH_CURRENT, count=1, controls=ctypes.addressof(value)
    )
    node.ioctl(request, call)
    if control.kind == abi.CTRL_TYPE_INTEGER64:
        return value.value64
    unsigned = value.value64 & 0xFFFF_FFFF
    if control.kind == abi.CTRL_TYPE_BITMASK:
        return unsigned
    return unsigned - (1 << 32) if unsigned >> 31 else unsigned


def control_name(raw: bytes) -> str:
    """Return a control's name as `v4l2-ctl` writes it: lower case, joined by underscores."""
    words = "".join(c if c.isalnum() else " " for c in raw.decode(errors="replace").lower())
    return "_".join(words.split())


def _plain(name: str) -> str:
    return " ".join(name.lower().split())
