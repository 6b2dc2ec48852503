"""What a node offers: pixel formats, sizes and rates; the one asked for, or the nearest named."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Final

from rig.errors import ConfigError, DeviceLostError
from rig_drivers.v4l2 import abi, structures
from rig_drivers.v4l2.node import Node
from rig_drivers.v4l2.pixels import DECODERS

RATE_TOLERANCE = 0.005
"""Largest relative difference between a rate asked for and one offered: 30 Hz takes 29.97 Hz."""
_LARGEST_PX: Final = 1 << 16


@dataclass(frozen=True, slots=True)
class Steps:
    """All numbers from `least` to `most` in steps; one number if both are the same."""

    least: int
    most: int
    step: int = 1

    def nearest(self, number: int) -> int:
        """Return the nearest number of the range."""
        step = max(1, self.step)
        last = (self.most - self.least) // step
        return self.least + step * min(max(round((number - self.least) / step), 0), last)


@dataclass(frozen=True, slots=True)
class SizeOffer:
    """Sizes in one pixel format."""

    pixel_format: str
    width_px: Steps
    height_px: Steps
    is_told: bool = True
    """Whether the node lists it; else only setting it shows whether the node takes it."""


@dataclass(frozen=True, slots=True)
class RateOffer:
    """Time from frame to frame: all from `shortest_s` to `longest_s`, or one value."""

    shortest_s: Fraction
    longest_s: Fraction

    def nearest(self, interval_s: Fraction) -> Fraction:
        """Return the nearest interval that is offered."""
        return min(max(interval_s, self.shortest_s), self.longest_s)


@dataclass(frozen=True, slots=True)
class Mode:
    """A pixel format, a size and a rate."""

    pixel_format: str
    width_px: int
    height_px: int
    rate_hz: float | None = None

    def __str__(self) -> str:
        size = f"{self.pixel_format} {self.width_px} x {self.height_px}"
        return size if self.rate_hz is None else f"{size} at {self.rate_hz:.4g} Hz"


@dataclass(frozen=True, slots=True)
class AppliedMode:
    """What the device was set to, as it reads back."""

    mode: Mode
    bytes_per_line: int


def size_offers(node: Node) -> list[SizeOffer]:
    """Ask a node for all its pixel formats and sizes; a format without sizes takes any.

    Receivers of a bare sensor (CSI) list no sizes: what comes depends on how the sensor is set.
    """
    return [
        offer
        for name in pixel_formats(node)
        for offer in (list(_sizes(node, name)) or [_any(name)])
    ]


def _any(name: str) -> SizeOffer:
    return SizeOffer(name, Steps(1, _LARGEST_PX), Steps(1, _LARGEST_PX), is_told=False)


def pixel_formats(node: Node) -> list[str]:
    """Ask a node for its pixel formats, four letters each."""
    described = node.entries(
        abi.VIDIOC_ENUM_FMT,
        lambda index: structures.FormatDescription(index=index, type=node.buffer_type),
    )
    return [abi.fourcc_name(entry.pixelformat) for entry in described]


def rate_offers(node: Node, mode: Mode) -> list[RateOffer]:
    """Ask a node for its rates in one pixel format and size; empty if it does not tell."""
    entries = node.entries(
        abi.VIDIOC_ENUM_FRAMEINTERVALS,
        lambda index: structures.FrameInterval(
            index=index,
            pixel_format=abi.fourcc(mode.pixel_format),
            width=mode.width_px,
            height=mode.height_px,
        ),
    )
    return list(_intervals(entries))


def nearest_size(offers: Sequence[SizeOffer], wanted: Mode) -> Mode | None:
    """Return what is nearest to the format and size asked for; None if nothing can be read.

    The same pixel format counts before the size; formats that rig cannot read do not count.
    """
    readable = [offer for offer in offers if offer.pixel_format in DECODERS]
    modes = [
        Mode(
            offer.pixel_format,
            offer.width_px.nearest(wanted.width_px),
            offer.height_px.nearest(wanted.height_px),
        )
        for offer in readable
    ]
    return min(modes, key=lambda mode: _distance(mode, wanted), default=None)


def set_mode(node: Node, wanted: Mode) -> AppliedMode:
    """Set pixel format, size and rate exactly as asked for, and read them back.

    Raises:
        ConfigError: the node does not offer it; the message names the nearest offer.
        DeviceLostError: it offers it, but sets something else or refuses.
    """
    if wanted.pixel_format not in DECODERS:
        raise ConfigError(
            f"camera.pixel_format: {wanted.pixel_format} cannot be read by rig",
            advice=f"readable are {', '.join(DECODERS)}",
        )
    offers = size_offers(node)
    nearest = nearest_size(offers, wanted)
    if nearest is None:
        listed = ", ".join(pixel_formats(node)) or "none"
        raise ConfigError(
            f"{node.name}: asked for {wanted}, offers no pixel format that rig can read "
            f"(found {listed})",
            advice=f"readable are {', '.join(DECODERS)}",
        )
    interval_s = None
    if wanted.rate_hz is not None:
        interval_s = _nearest_interval(node, nearest, wanted.rate_hz)
    rate_hz = None if interval_s is None else float(1 / interval_s)
    offered = Mode(nearest.pixel_format, nearest.width_px, nearest.height_px, rate_hz)
    expected = wanted if rate_hz is not None else _without_rate(wanted)
    if not _is_same(offered, expected):
        raise _not_offered(node, wanted, offered)
    if not _takes_a_rate(node):
        # It tells how fast it can run, but not how fast it does: the frames will show.
        offered, interval_s = _without_rate(offered), None
    try:
        pixels = _set_pixels(node, offered)
        applied_hz = _set_interval(node, interval_s)
    except OSError as error:
        raise DeviceLostError(
            node.name,
            f"offers {offered}, but refuses it: {error.strerror}",
            advice="is it in use?",
        ) from error
    applied = replace(pixels.mode, rate_hz=applied_hz or offered.rate_hz)
    if not _is_same(applied, offered):
        if not all(offer.is_told for offer in offers if offer.pixel_format == wanted.pixel_format):
            raise _not_offered(node, wanted, applied)
        raise DeviceLostError(
            node.name,
            f"asked for {offered}, which it offers, it was set to {applied} instead",
            advice="ask for that, or plug it in again",
        )
    return replace(pixels, mode=applied)


def _not_offered(node: Node, wanted: Mode, nearest: Mode) -> ConfigError:
    keys = "camera.pixel_format, width_px and height_px"
    if nearest.rate_hz is not None:
        keys = "camera.pixel_format, width_px, height_px and rate_hz"
    return ConfigError(
        f"{node.name}: asked for {wanted}, the nearest it offers is {nearest}",
        advice=f"set {keys} to that",
    )


def _without_rate(mode: Mode) -> Mode:
    return replace(mode, rate_hz=None)


def _sizes(node: Node, name: str) -> Iterator[SizeOffer]:
    entries = node.entries(
        abi.VIDIOC_ENUM_FRAMESIZES,
        lambda index: structures.FrameSize(index=index, pixel_format=abi.fourcc(name)),
    )
    for entry in entries:
        if entry.type == abi.DISCRETE:
            size = entry.size.discrete
            yield SizeOffer(name, Steps(size.width, size.width), Steps(size.height, size.height))
        else:
            size = entry.size.stepwise
            yield SizeOffer(
                name,
                Steps(size.min_width, size.max_width, size.step_width),
                Steps(size.min_height, size.max_height, size.step_height),
            )
            return  # a range is the only entry of its list


def _intervals(entries: Iterator[structures.FrameInterval]) -> Iterator[RateOffer]:
    for entry in entries:
        if entry.type == abi.DISCRETE:
            interval_s = seconds(entry.interval.discrete)
            if interval_s is not None:
                yield RateOffer(interval_s, interval_s)
        else:
            shortest_s = seconds(entry.interval.stepwise.min)
            longest_s = seconds(entry.interval.stepwise.max)
            if shortest_s is not None and longest_s is not None:
                yield RateOffer(shortest_s, longest_s)
            return


def seconds(fraction: structures.Fraction) -> Fraction | None:
    """Return a frame interval in s; None where the driver gives none."""
    if fraction.numerator == 0 or fraction.denominator == 0:
        return None
    return Fraction(fraction.numerator, fraction.denominator)


def _nearest_interval(node: Node, mode: Mode, rate_hz: float) -> Fraction | None:
    wanted_s = Fraction(1 / rate_hz).limit_denominator(1_000_000)
    offered_s = [offer.nearest(wanted_s) for offer in rate_offers(node, mode)]
    if not offered_s:
        current_s = _interval(node)
        offered_s = [] if current_s is None else [current_s]
    return min(offered_s, key=lambda s: abs(math.log(s / wanted_s)), default=None)


def _is_same(one: Mode, other: Mode) -> bool:
    if (one.pixel_format, one.width_px, one.height_px) != (
        other.pixel_format,
        other.width_px,
        other.height_px,
    ):
        return False
    if other.rate_hz is None:
        return True
    if one.rate_hz is None:
        return False
    return math.isclose(one.rate_hz, other.rate_hz, rel_tol=RATE_TOLERANCE)


def _distance(mode: Mode, wanted: Mode) -> tuple[bool, float]:
    size = abs(math.log(mode.width_px / wanted.width_px))
    size += abs(math.log(mode.height_px / wanted.height_px))
    return mode.pixel_format != wanted.pixel_format, size


def _set_pixels(node: Node, mode: Mode) -> AppliedMode:
    asked = structures.Format(type=node.buffer_type)
    is_planar = node.buffer_type == abi.BUF_TYPE_VIDEO_CAPTURE_MPLANE
    pixels = asked.fmt.pix_mp if is_planar else asked.fmt.pix
    pixels.width = mode.width_px
    pixels.height = mode.height_px
    pixels.pixelformat = abi.fourcc(mode.pixel_format)
    pixels.field = abi.FIELD_ANY
    node.ioctl(abi.VIDIOC_S_FMT, asked)
    applied = Mode(abi.fourcc_name(pixels.pixelformat), pixels.width, pixels.height)
    if not is_planar:
        return AppliedMode(applied, asked.fmt.pix.bytesperline)
    planes = asked.fmt.pix_mp
    if planes.num_planes != 1:
        raise DeviceLostError(
            node.name,
            f"gives {applied} in {planes.num_planes} planes of memory, rig reads one",
            advice="ask for another camera.pixel_format",
        )
    return AppliedMode(applied, planes.plane_fmt[0].bytesperline)


def _set_interval(node: Node, interval_s: Fraction | None) -> float | None:
    """Set the time from frame to frame; a node with one fixed rate is only read."""
    if interval_s is None:
        return None
    asked = structures.StreamParameters(type=node.buffer_type)
    node.ioctl(abi.VIDIOC_G_PARM, asked)
    if asked.parm.capture.capability & abi.PARAMETER_TIME_PER_FRAME:
        asked.parm.capture.timeperframe.numerator = interval_s.numerator
        asked.parm.capture.timeperframe.denominator = interval_s.denominator
        node.ioctl(abi.VIDIOC_S_PARM, asked)
    applied_s = seconds(asked.parm.capture.timeperframe)
    return None if applied_s is None else float(1 / applied_s)


def _takes_a_rate(node: Node) -> bool:
    return _parameters(node) is not None


def _interval(node: Node) -> Fraction | None:
    asked = _parameters(node)
    return None if asked is None else seconds(asked.parm.capture.timeperframe)


def _parameters(node: Node) -> structures.StreamParameters | None:
    """Ask how the node streams; None where it does not tell, as receivers of bare sensors."""
    asked = structures.StreamParameters(type=node.buffer_type)
    try:
        node.ioctl(abi.VIDIOC_G_PARM, asked)
    except OSError:
        return None
    return asked
