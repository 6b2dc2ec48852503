"""The pictures of one camera as Aravis collects them: buffers out, values back."""

import ctypes
import time
from typing import Final

import numpy as np

from rig_genicam.aravis import Aravis, CallError
from rig_genicam.door import BUFFERS, CHUNKS, Buffer, Packets

_COMPLETE: Final = 0
_TROUBLES: Final = {
    1: "never filled",
    2: "not complete in time",
    3: "packets are missing",
    4: "packets of another picture",
    5: "larger than what was agreed upon",
    7: "broken off",
}
"""By ArvBufferStatus."""
_PICTURES: Final = (1, 4, 5)
"""ArvBufferPayloadType: a picture, and pictures with chunks (in the words of GigE Vision)."""
_INTEGERS: Final = ("Timestamp", "FrameID")


class AravisStream:
    """Buffers of a device, from opening to `close`.

    Args:
        aravis: the library.
        device: handle of the device.
        size_bytes: of one picture with its chunks.

    Raises:
        CallError: there is no stream to be had.
    """

    def __init__(self, aravis: Aravis, device: int, size_bytes: int) -> None:
        self._aravis = aravis
        self._handle: int = aravis.checked("device_create_stream", device, None, None)
        self._parser: int = aravis("device_create_chunk_parser", device)
        self._tick_ns = _tick_ns(aravis, device)
        for _ in range(BUFFERS):
            aravis("stream_push_buffer", self._handle, aravis("buffer_new_allocate", size_bytes))

    def next(self, timeout_s: float) -> Buffer | None:
        """See `GenicamDevice.next`."""
        wait_us = max(0, round(1e6 * timeout_s))
        buffer = self._aravis("stream_timeout_pop_buffer", self._handle, wait_us)
        if not buffer:
            return None
        try:
            return self._read(buffer)
        finally:
            self._aravis("stream_push_buffer", self._handle, buffer)

    @property
    def packets(self) -> Packets:
        """See `GenicamDevice.packets`."""
        names = ("n_received_packets", "n_missing_packets", "n_resent_packets")
        return Packets(
            *(self._aravis("stream_get_info_uint64_by_name", self._handle, n) for n in names)
        )

    def close(self) -> None:
        """End the stream and give its buffers back."""
        self._aravis.release(self._parser)
        self._aravis.release(self._handle)

    def _read(self, buffer: int) -> Buffer:
        aravis = self._aravis
        status = aravis("buffer_get_status", buffer)
        trouble = "" if status == _COMPLETE else _TROUBLES.get(status, f"status {status}")
        if not trouble and aravis("buffer_get_payload_type", buffer) not in _PICTURES:
            trouble = "no picture"
        if trouble:
            return Buffer(np.empty(0, np.uint8), 0, 0, 0, 0, 0, _arrived_s(0), trouble)
        size = ctypes.c_size_t()
        start = aravis("buffer_get_image_data", buffer, ctypes.byref(size))
        padding, lines = ctypes.c_int(), ctypes.c_int()
        aravis("buffer_get_image_padding", buffer, ctypes.byref(padding), ctypes.byref(lines))
        return Buffer(
            data=np.frombuffer(ctypes.string_at(start, size.value), np.uint8),
            width_px=aravis("buffer_get_image_width", buffer),
            height_px=aravis("buffer_get_image_height", buffer),
            pixel_bits=aravis("buffer_get_image_pixel_format", buffer) >> 16 & 0xFF,
            frame_id=aravis("buffer_get_frame_id", buffer),
            device_ns=aravis("buffer_get_timestamp", buffer),
            arrived_s=_arrived_s(aravis("buffer_get_system_timestamp", buffer)),
            padding_bytes=padding.value,
            chunks=self._chunks(buffer) if aravis("buffer_has_chunks", buffer) else {},
        )

    def _chunks(self, buffer: int) -> dict[str, float]:
        found: dict[str, float] = {}
        for name in CHUNKS:
            sort = "integer" if name in _INTEGERS else "float"
            try:
                value = self._aravis.checked(
                    f"chunk_parser_get_{sort}_value", self._parser, buffer, f"Chunk{name}"
                )
            except CallError:
                continue  # not offered, or not sent with this picture
            found[name] = float(value) * (self._tick_ns if name == "Timestamp" else 1.0)
        return found


def _tick_ns(aravis: Aravis, device: int) -> float:
    """Return the unit of the camera's clock; USB3 Vision counts in ns."""
    if not aravis.is_a(device, "gv_device"):
        return 1.0
    try:
        frequency_hz = aravis.checked("gv_device_get_timestamp_tick_frequency", device)
    except CallError:
        return 1.0
    return 1e9 / frequency_hz if frequency_hz else 1.0


def _arrived_s(system_ns: int) -> float:
    """Return when the first bytes came on CLOCK_MONOTONIC; the library tells the time of day.

    Where that was set meanwhile, and for what it gives no time for, now is the latest it can be.
    """
    now_s, passed_s = time.monotonic(), 1e-9 * (time.time_ns() - system_ns)
    return now_s - passed_s if 0.0 <= passed_s < 10.0 else now_s
