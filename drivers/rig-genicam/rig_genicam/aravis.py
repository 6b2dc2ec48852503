"""The only door to libaravis (LGPL), by its C interface: no bindings, no headers, any Python.

Every function is declared once in `_FUNCTIONS`. What fails tells so by a GError, which becomes an
error of rig here.
"""

import ctypes
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint, c_uint64
from functools import cache
from typing import Any, Final

from rig.errors import DeviceNotFoundError

SONAME: Final = "libaravis-0.8.so.0"
_GOBJECT: Final = "libgobject-2.0.so.0"
_GLIB: Final = "libglib-2.0.so.0"
_P: Final = ctypes.c_void_p


class _GError(ctypes.Structure):
    _fields_ = (("domain", ctypes.c_uint32), ("code", c_int), ("message", c_char_p))


_ERROR: Final = POINTER(POINTER(_GError))
_GONE: Final = (2, 4, 5, 10)
"""ArvDeviceError: not connected, transfer error, timeout, not the controller."""
LOST_CALLBACK: Final = ctypes.CFUNCTYPE(None, _P, _P)

_FUNCTIONS: Final[dict[str, tuple[Any, tuple[Any, ...]]]] = {
    "arv_update_device_list": (None, ()),
    "arv_get_n_devices": (c_uint, ()),
    "arv_get_device_id": (c_char_p, (c_uint,)),
    "arv_get_device_vendor": (c_char_p, (c_uint,)),
    "arv_get_device_model": (c_char_p, (c_uint,)),
    "arv_get_device_serial_nbr": (c_char_p, (c_uint,)),
    "arv_get_device_address": (c_char_p, (c_uint,)),
    "arv_get_device_protocol": (c_char_p, (c_uint,)),
    "arv_open_device": (_P, (c_char_p, _ERROR)),
    "arv_device_error_quark": (ctypes.c_uint32, ()),
    "arv_device_get_feature": (_P, (_P, c_char_p)),
    "arv_device_is_feature_available": (c_int, (_P, c_char_p, _ERROR)),
    "arv_device_execute_command": (None, (_P, c_char_p, _ERROR)),
    "arv_device_get_boolean_feature_value": (c_int, (_P, c_char_p, _ERROR)),
    "arv_device_set_boolean_feature_value": (None, (_P, c_char_p, c_int, _ERROR)),
    "arv_device_get_string_feature_value": (c_char_p, (_P, c_char_p, _ERROR)),
    "arv_device_set_string_feature_value": (None, (_P, c_char_p, c_char_p, _ERROR)),
    "arv_device_get_integer_feature_value": (c_int64, (_P, c_char_p, _ERROR)),
    "arv_device_set_integer_feature_value": (None, (_P, c_char_p, c_int64, _ERROR)),
    "arv_device_get_integer_feature_bounds": (
        None,
        (_P, c_char_p, POINTER(c_int64), POINTER(c_int64), _ERROR),
    ),
    "arv_device_get_integer_feature_increment": (c_int64, (_P, c_char_p, _ERROR)),
    "arv_device_get_float_feature_value": (c_double, (_P, c_char_p, _ERROR)),
    "arv_device_set_float_feature_value": (None, (_P, c_char_p, c_double, _ERROR)),
    "arv_device_get_float_feature_bounds": (
        None,
        (_P, c_char_p, POINTER(c_double), POINTER(c_double), _ERROR),
    ),
    "arv_device_dup_available_enumeration_feature_values_as_strings": (
        _P,
        (_P, c_char_p, POINTER(c_uint), _ERROR),
    ),
    "arv_device_create_stream": (_P, (_P, _P, _P, _ERROR)),
    "arv_device_create_chunk_parser": (_P, (_P,)),
    "arv_chunk_parser_get_integer_value": (c_int64, (_P, _P, c_char_p, _ERROR)),
    "arv_chunk_parser_get_float_value": (c_double, (_P, _P, c_char_p, _ERROR)),
    "arv_gv_device_is_controller": (c_int, (_P,)),
    "arv_gv_device_get_timestamp_tick_frequency": (c_uint64, (_P, _ERROR)),
    "arv_buffer_new_allocate": (_P, (c_size_t,)),
    "arv_buffer_get_status": (c_int, (_P,)),
    "arv_buffer_get_timestamp": (c_uint64, (_P,)),
    "arv_buffer_get_system_timestamp": (c_uint64, (_P,)),
    "arv_buffer_get_frame_id": (c_uint64, (_P,)),
    "arv_buffer_get_image_data": (_P, (_P, POINTER(c_size_t))),
    "arv_buffer_get_image_width": (c_int, (_P,)),
    "arv_buffer_get_image_height": (c_int, (_P,)),
    "arv_buffer_get_image_pixel_format": (ctypes.c_uint32, (_P,)),
    "arv_buffer_get_image_padding": (None, (_P, POINTER(c_int), POINTER(c_int))),
    "arv_buffer_get_payload_type": (c_int, (_P,)),
    "arv_buffer_has_chunks": (c_int, (_P,)),
    "arv_stream_push_buffer": (None, (_P, _P)),
    "arv_stream_timeout_pop_buffer": (_P, (_P, c_uint64)),
    "arv_stream_get_info_uint64_by_name": (c_uint64, (_P, c_char_p)),
    **{
        f"arv_{name}_get_type": (c_size_t, ())
        for name in ("gc_enumeration", "gc_boolean", "gc_command", "gc_string", "gc_float",
                     "gc_integer", "gv_device")
    },
}  # fmt: skip


class CallError(Exception):
    """A GError of the library.

    Args:
        message: its own words.
        is_gone: whether it means that the camera does not answer.
    """

    def __init__(self, message: str, *, is_gone: bool) -> None:
        super().__init__(message)
        self.is_gone = is_gone


class Aravis:
    """The functions of the library, by name and with their errors."""

    def __init__(self, functions: ctypes.CDLL, objects: ctypes.CDLL, glib: ctypes.CDLL) -> None:
        self._functions: dict[str, Any] = {}
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(functions, name)
            function.restype, function.argtypes = result, list(arguments)
            self._functions[name] = function
        self._objects = objects
        self._objects.g_object_unref.argtypes = [_P]
        self._objects.g_type_check_instance_is_a.argtypes = [_P, c_size_t]
        self._objects.g_signal_connect_data.argtypes = [_P, c_char_p, _P, _P, _P, c_int]
        self._objects.g_signal_connect_data.restype = ctypes.c_ulong
        self._objects.g_signal_handler_disconnect.argtypes = [_P, ctypes.c_ulong]
        self._glib = glib
        self._glib.g_free.argtypes = [_P]
        self._glib.g_error_free.argtypes = [_P]
        self._device_errors = self("device_error_quark")

    def __call__(self, name: str, *arguments: Any) -> Any:
        """Call `arv_` + name; texts are UTF-8."""
        given = [a.encode() if isinstance(a, str) else a for a in arguments]
        result = self._functions[f"arv_{name}"](*given)
        return result.decode(errors="replace") if isinstance(result, bytes) else result

    def checked(self, name: str, *arguments: Any) -> Any:
        """Call a function whose last argument is a GError.

        Raises:
            CallError: it failed.
        """
        error = POINTER(_GError)()
        result = self(name, *arguments, byref(error))
        if not error:
            return result
        found = error.contents
        message = (found.message or b"").decode(errors="replace")
        is_gone = found.domain == self._device_errors and found.code in _GONE
        self._glib.g_error_free(error)
        raise CallError(message, is_gone=is_gone)

    def texts(self, name: str, *arguments: Any) -> list[str]:
        """Call a function that gives an array of texts, their number, and a GError.

        Raises:
            CallError: it failed.
        """
        count = c_uint()
        array = self.checked(name, *arguments, byref(count))
        if not array:
            return []
        entries = ctypes.cast(array, POINTER(c_char_p))
        found = [(entries[i] or b"").decode(errors="replace") for i in range(count.value)]
        self._glib.g_free(array)
        return found

    def is_a(self, instance: int, type_name: str) -> bool:
        """Whether an object is of the type with `arv_` + type_name + `_get_type`."""
        kind = self(f"{type_name}_get_type")
        return bool(self._objects.g_type_check_instance_is_a(instance, kind))

    def on(self, instance: int, signal: str, callback: Any) -> int:
        """Have a callback called at a signal, in a thread of the library; returns its number."""
        pointer = ctypes.cast(callback, _P)
        return self._objects.g_signal_connect_data(
            instance, signal.encode(), pointer, None, None, 0
        )

    def off(self, instance: int, number: int) -> None:
        """Have a callback called no more."""
        self._objects.g_signal_handler_disconnect(instance, number)

    def release(self, instance: int) -> None:
        """Give an object back."""
        self._objects.g_object_unref(instance)


@cache
def load_aravis() -> Aravis:
    """Return the library, loaded once.

    Raises:
        DeviceNotFoundError: it is not installed, or too old.
    """
    try:
        return Aravis(*(ctypes.CDLL(name) for name in (SONAME, _GOBJECT, _GLIB)))
    except (OSError, AttributeError) as error:
        raise DeviceNotFoundError(
            "rig-genicam",
            f"asked for {SONAME}, found: {error}",
            advice="sudo apt install libaravis-0.8-0 (0.8.20 or newer)",
        ) from error
