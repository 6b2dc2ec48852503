"""The settings of the simulated Marlin, and how it prints them."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.profile import FirmwareConfig
from rig_sim.firmware.axes import AXES, Vector

LETTERS = "XYZABCUVW"
"""Axes in the order in which a build counts them; those after Z turn no motor."""


@dataclass(slots=True)
class MarlinSettings:
    """Limits per axis; what is set lasts until the next start."""

    steps: dict[str, float]
    rate_mm_s: dict[str, float]
    acceleration: dict[str, float]
    travel_acceleration: float
    range_mm: dict[str, tuple[float, float]]
    has_soft_stops: bool
    keepalive_s: float
    emergency_parser: bool
    axes: int = len(AXES)
    feed_share: float = 1.0

    @classmethod
    def of(cls, config: FirmwareConfig) -> "MarlinSettings":
        """Return the settings of a configured controller."""
        return cls(
            steps=dict.fromkeys(AXES, 80.0) | {config.axis: config.steps_per_mm},
            rate_mm_s=dict.fromkeys(AXES, 300.0) | {config.axis: config.max_rate_mm_s},
            acceleration=dict.fromkeys(AXES, 3000.0) | {config.axis: config.acceleration_mm_s2},
            travel_acceleration=config.acceleration_mm_s2,
            range_mm=dict.fromkeys(AXES, (0.0, 200.0)) | {config.axis: (0.0, config.travel_mm)},
            has_soft_stops=config.soft_limits,
            keepalive_s=config.marlin.busy_s,
            emergency_parser=config.marlin.emergency_parser,
            axes=config.marlin.axes,
        )

    def max_rate_mm_s(self, axis: int) -> float:
        """See `rig_sim.firmware.steppers.Limits`."""
        return self.rate_mm_s[AXES[axis]]

    def acceleration_mm_s2(self, axis: int) -> float:
        """See `rig_sim.firmware.steppers.Limits`."""
        return min(self.acceleration[AXES[axis]], self.travel_acceleration)

    def steps_per_mm(self, axis: int) -> float:
        """See `rig_sim.firmware.steppers.Limits`."""
        return self.steps[AXES[axis]]

    def lines(self) -> list[str]:
        """Return the answer to M503."""
        travel = f"{self.travel_acceleration:.2f}"
        return [
            "echo:; Linear Units:",
            "echo:  G21 ; (mm)",
            "echo:; Steps per unit:",
            f"echo:  M92{_row(self.steps)} E500.00",
            "echo:; Max feedrates (units/s):",
            f"echo:  M203{_row(self.rate_mm_s)} E25.00",
            "echo:; Max Acceleration (units/s2):",
            f"echo:  M201{_row(self.acceleration)} E10000.00",
            "echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):",
            f"echo:  M204 P{travel} R3000.00 T{travel}",
            "echo:; Home offset:",
            "echo:  M206 X0.00 Y0.00 Z0.00",
        ]

    def soft_stop_lines(self) -> list[str]:
        """Return the answer to M211."""
        low = _row({axis: ends[0] for axis, ends in self.range_mm.items()})
        high = _row({axis: ends[1] for axis, ends in self.range_mm.items()})
        state = "1 ; ON" if self.has_soft_stops else "0 ; OFF"
        return [f"echo:  M211 S{state}", f"echo:  Min: {low}   Max: {high}"]


def _row(values: Mapping[str, float]) -> str:
    return "".join(f" {axis}{value:.2f}" for axis, value in values.items())


def banner() -> list[str]:
    """Return what is printed at the start, before the settings."""
    return [
        "start",
        "echo:Marlin 2.1.2.1",
        "echo: Last Updated: 2023-05-16 | Author: (none, default config)",
        "echo: Free Memory: 3712  PlannerBufferBytes: 1152",
        "echo:Hardcoded Default Settings Loaded",
    ]


def about(settings: MarlinSettings) -> list[str]:
    """Return the answer to M115."""
    return [
        "FIRMWARE_NAME:Marlin 2.1.2.1 (May 16 2023 12:00:00) SOURCE_CODE_URL:github.com/"
        "MarlinFirmware/Marlin PROTOCOL_VERSION:1.0 MACHINE_TYPE:3D Printer EXTRUDER_COUNT:1 "
        "UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff",
        "Cap:SERIAL_XON_XOFF:0",
        "Cap:EEPROM:0",
        f"Cap:EMERGENCY_PARSER:{int(settings.emergency_parser)}",
        "Cap:HOST_ACTION_COMMANDS:0",
    ]


def position_line(at_mm: Vector, settings: MarlinSettings) -> str:
    """Return the answer to M114: the planned position."""
    places = dict.fromkeys(LETTERS[: settings.axes], 0.0)
    places |= {axis: mm for axis, mm in zip(AXES, at_mm, strict=True) if axis in places}
    logical = " ".join(f"{axis}:{mm:.2f}" for axis, mm in places.items())
    counts = " ".join(
        f"{axis}:{round(mm * settings.steps.get(axis, 80.0))}" for axis, mm in places.items()
    )
    return f"{logical}{' E:0.00' if settings.axes >= len(AXES) else ''} Count {counts}"
