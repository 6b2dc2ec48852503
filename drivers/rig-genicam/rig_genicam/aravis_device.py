"""One camera that Aravis has opened: its features."""

import ctypes
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final

from rig.errors import DeviceLostError
from rig_genicam.aravis import LOST_CALLBACK, Aravis, CallError
from rig_genicam.aravis_stream import AravisStream
from rig_genicam.config import FeatureValue
from rig_genicam.door import Buffer, Packets, RefusedError

_SORTS: Final = ("enumeration", "boolean", "command", "string", "float", "integer")
"""A list is an integer and a text as well: the first that fits."""
_VALUES: Final = {
    "enumeration": ("string", str),
    "string": ("string", str),
    "boolean": ("boolean", bool),
    "float": ("float", float),
    "integer": ("integer", int),
}


class AravisDevice:
    """A camera between opening and closing; keeps `GenicamDevice`.

    Args:
        aravis: the library.
        handle: of the opened device; it is given back by `close`.
        name: for messages.
    """

    def __init__(self, aravis: Aravis, handle: int, name: str) -> None:
        self._aravis = aravis
        self._handle: int | None = handle
        self._name = name
        self._stream: AravisStream | None = None
        self._is_lost = False
        self._on_lost = LOST_CALLBACK(self._note_lost)  # kept as long as it may be called
        self._signal = aravis.on(handle, "control-lost", self._on_lost)
        self._sorts: dict[str, str] = {}

    def _note_lost(self, _device: Any, _data: Any) -> None:
        self._is_lost = True

    @property
    def name(self) -> str:
        """See `GenicamDevice.name`."""
        return self._name

    def has(self, feature: str) -> bool:
        """See `GenicamDevice.has`."""
        if not self._sort(feature):
            return False
        return bool(self._call("device_is_feature_available", feature))

    def is_command(self, feature: str) -> bool:
        """See `GenicamDevice.is_command`."""
        return self._sort(feature) == "command"

    def read(self, feature: str) -> FeatureValue:
        """See `GenicamDevice.read`."""
        sort, python = _VALUES.get(self._sort(feature), ("", str))
        if not sort:
            raise RefusedError(f"{feature} has no value")
        return python(self._call(f"device_get_{sort}_feature_value", feature))

    def write(self, feature: str, value: FeatureValue) -> None:
        """See `GenicamDevice.write`."""
        if self.is_command(feature):
            self._call("device_execute_command", feature)
            return
        sort, python = _VALUES.get(self._sort(feature), ("", str))
        is_text = isinstance(value, str)
        if not sort or is_text != (python is str) or (python is int and value != int(value)):
            raise RefusedError(f"it takes {python.__name__}, not {value!r}")
        self._call(f"device_set_{sort}_feature_value", feature, python(value))

    def bounds(self, feature: str) -> tuple[float, float, float] | None:
        """See `GenicamDevice.bounds`."""
        sort = self._sort(feature)
        if sort not in ("float", "integer"):
            return None
        number = ctypes.c_double if sort == "float" else ctypes.c_int64
        least, most = number(), number()
        self._call(
            f"device_get_{sort}_feature_bounds", feature, ctypes.byref(least), ctypes.byref(most)
        )
        step = 0.0
        if sort == "integer":
            step = float(self._call("device_get_integer_feature_increment", feature))
        return float(least.value), float(most.value), step

    def entries(self, feature: str) -> Sequence[str] | None:
        """See `GenicamDevice.entries`."""
        if self._sort(feature) != "enumeration":
            return None
        name = "device_dup_available_enumeration_feature_values_as_strings"
        try:
            return self._aravis.texts(name, self._opened(), feature)
        except CallError as error:
            raise self._told(error) from error

    def open_stream(self) -> None:
        """See `GenicamDevice.open_stream`."""
        size = int(self.read("PayloadSize"))
        try:
            self._stream = AravisStream(self._aravis, self._opened(), size)
        except CallError as error:
            raise DeviceLostError(
                self._name,
                f"gives no pictures: {error}",
                advice="check that the network lets its packets through",
            ) from error

    def start(self) -> None:
        """See `GenicamDevice.start`."""
        self.write("AcquisitionStart", True)

    def next(self, timeout_s: float) -> Buffer | None:
        """See `GenicamDevice.next`."""
        if self._is_lost:
            raise self._lost("control of it was lost")
        return None if self._stream is None else self._stream.next(timeout_s)

    def require_there(self) -> None:
        """See `GenicamDevice.require_there`."""
        if self._is_lost:
            raise self._lost("control of it was lost")
        self.read("Width")

    @property
    def packets(self) -> Packets:
        """See `GenicamDevice.packets`."""
        return Packets() if self._stream is None else self._stream.packets

    def close(self) -> None:
        """See `GenicamDevice.close`."""
        if self._handle is None:
            return
        handle, self._handle = self._handle, None
        if self._is_lost:  # the library then waits for answers, some ten seconds in all
            name = f"{self._name} given back"
            threading.Thread(target=self._give_back, args=(handle,), name=name, daemon=True).start()
            return
        with suppress(CallError):  # whoever is gone has stopped
            self._aravis.checked("device_execute_command", handle, "AcquisitionStop")
        self._give_back(handle)

    def _give_back(self, handle: int) -> None:
        if self._stream is not None:
            self._stream.close()
        self._aravis.off(handle, self._signal)
        self._aravis.release(handle)

    def _sort(self, feature: str) -> str:
        if feature not in self._sorts:
            node = self._aravis("device_get_feature", self._opened(), feature)
            fits = (s for s in _SORTS if node and self._aravis.is_a(node, f"gc_{s}"))
            self._sorts[feature] = next(fits, "")
        return self._sorts[feature]

    def _call(self, name: str, *arguments: Any) -> Any:
        try:
            return self._aravis.checked(name, self._opened(), *arguments)
        except CallError as error:
            raise self._told(error) from error

    def _told(self, error: CallError) -> RefusedError | DeviceLostError:
        if not error.is_gone:
            return RefusedError(str(error))
        self._is_lost = True  # asking again would take seconds each time
        return self._lost(str(error))

    def _opened(self) -> int:
        if self._handle is None:
            raise self._lost("it was closed")
        return self._handle

    def _lost(self, why: str) -> DeviceLostError:
        return DeviceLostError(
            self._name,
            f"does not answer any more: {why}",
            advice="check its cable and power, then open it again",
        )
