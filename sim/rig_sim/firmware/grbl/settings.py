"""The numbered settings (`$$`) of GRBL 1.1."""

import re
from dataclasses import dataclass

from rig.profile import FirmwareConfig
from rig_sim.firmware.axes import AXES

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)", re.ASCII)
"""A number as GRBL reads it: no exponents."""

BAD_NUMBER = 2
NEGATIVE_VALUE = 4
STEP_PULSE_TOO_SHORT = 6
INVALID_STATEMENT = 3
SETTING_DISABLED = 5
SOFT_LIMITS_NEED_HOMING = 10

_DEFAULTS: dict[int, float] = {
    0: 10, 1: 25, 2: 0, 3: 0, 4: 0, 5: 0, 6: 0, 10: 1, 11: 0.010, 12: 0.002, 13: 0,
    20: 0, 21: 0, 22: 0, 23: 0, 24: 25.0, 25: 500.0, 26: 250, 27: 1.0, 30: 1000, 31: 0, 32: 0,
    100: 250.0, 101: 250.0, 102: 250.0, 110: 500.0, 111: 500.0, 112: 500.0,
    120: 10.0, 121: 10.0, 122: 10.0, 130: 200.0, 131: 200.0, 132: 200.0,
}  # fmt: skip
_NEVER_ZERO = frozenset({24, 25, 100, 101, 102, 110, 111, 112, 120, 121, 122})
_WITH_DECIMALS = frozenset(n for n in _DEFAULTS if n in {11, 12, 24, 25, 27} or n >= 100)


@dataclass(slots=True)
class GrblSettings:
    """Values by number; they survive every reset, as in the EEPROM."""

    values: dict[int, float]
    dialect: str = "grbl"
    homes_z_first: bool = False
    homes_single_axis: bool = True
    connecting_s: float = 0.0

    @classmethod
    def of(cls, config: FirmwareConfig) -> "GrblSettings":
        """Return the settings of a configured controller."""
        axis = AXES.index(config.axis)
        return cls(
            _DEFAULTS
            | {
                1: 255.0,
                20: float(config.soft_limits and config.homing),
                21: float(config.hard_limits),
                22: float(config.homing),
                24: config.homing_locate_mm_s * 60.0,
                25: config.homing_mm_s * 60.0,
                26: round(config.homing_pause_s * 1e3),
                27: config.pull_off_mm,
                100 + axis: config.steps_per_mm,
                110 + axis: config.max_rate_mm_s * 60.0,
                120 + axis: config.acceleration_mm_s2,
                130 + axis: config.travel_mm,
            },
            config.grbl_dialect,
            config.homes_z_first,
            config.homes_single_axis,
            config.connecting_s,
        )

    def lines(self) -> list[str]:
        """Return the answer to `$$`."""
        if self.dialect == "fluidnc":  # the rest is in its configuration file
            return [f"$10={self.values[10]:.0f}"]
        text = ["$300=grblHAL", "$302=192.168.5.1"] if self.dialect == "grblhal" else []
        return [*self._numbers(), *text]

    def tree_lines(self, path: str) -> list[str]:
        """Return FluidNC's answer to a question for a value of its configuration."""
        known: dict[str, str] = {"/stepping/idle_ms": f"{self.values[1]:.0f}"}
        for axis, name in enumerate(AXES.lower()):
            known |= {
                f"/axes/{name}/soft_limits": str(self.soft_limits).lower(),
                f"/axes/{name}/max_rate_mm_per_min": f"{self.values[110 + axis]:.3f}",
                f"/axes/{name}/acceleration_mm_per_sec2": f"{self.values[120 + axis]:.3f}",
                f"/axes/{name}/max_travel_mm": f"{self.values[130 + axis]:.3f}",
            }
            if self.homing:
                known[f"/axes/{name}/homing/mpos_mm"] = "0.000"
                known[f"/axes/{name}/homing/positive_direction"] = "true"
                known[f"/axes/{name}/homing/seek_mm_per_min"] = f"{self.values[25]:.3f}"
                known[f"/axes/{name}/homing/feed_mm_per_min"] = f"{self.values[24]:.3f}"
                known[f"/axes/{name}/homing/settle_ms"] = f"{self.values[26]:.0f}"
                known[f"/axes/{name}/motor0/pulloff_mm"] = f"{self.values[27]:.3f}"
        return [f"${path}={known[path]}"] if path in known else []

    def _numbers(self) -> list[str]:
        return [
            f"${number}={value:.3f}" if number in _WITH_DECIMALS else f"${number}={value:.0f}"
            for number, value in sorted(self.values.items())
        ]

    def store(self, assignment: str) -> int:
        """Execute `number=value`; returns the error code, 0 when it was taken."""
        name, equals, text = assignment.partition("=")
        if not NUMBER.fullmatch(name):
            return BAD_NUMBER
        if not equals or float(name) not in self.values:
            return INVALID_STATEMENT
        if not NUMBER.fullmatch(text):
            return BAD_NUMBER
        return self._store(int(float(name)), float(text))

    def _store(self, key: int, value: float) -> int:
        # A real controller takes 0 steps per mm or no acceleration, and then divides by it.
        if value < 0.0 or (value == 0.0 and key in _NEVER_ZERO):
            return NEGATIVE_VALUE
        if key == 0 and value < 3:
            return STEP_PULSE_TOO_SHORT
        if key == 20 and value and not self.homing:
            return SOFT_LIMITS_NEED_HOMING
        self.values[key] = value if key in _WITH_DECIMALS else float(int(value))
        if key == 22 and not value:
            self.values[20] = 0.0
        return 0

    @property
    def homing(self) -> bool:
        """$22."""
        return bool(self.values[22])

    @property
    def soft_limits(self) -> bool:
        """$20."""
        return bool(self.values[20])

    @property
    def hard_limits(self) -> bool:
        """$21."""
        return bool(self.values[21])

    @property
    def in_inches(self) -> bool:
        """$13: reports in inches."""
        return bool(self.values[13])

    def homes_down(self, axis: int) -> bool:
        """$23: homing searches towards smaller coordinates; the simulated switch is at 0."""
        return bool(int(self.values[23]) >> axis & 1)

    def steps_per_mm(self, axis: int) -> float:
        """$100 and following."""
        return self.values[100 + axis]

    def max_rate_mm_s(self, axis: int) -> float:
        """$110 and following, which are in mm per minute."""
        return self.values[110 + axis] / 60.0

    def acceleration_mm_s2(self, axis: int) -> float:
        """$120 and following."""
        return self.values[120 + axis]

    def max_travel_mm(self, axis: int) -> float:
        """$130 and following."""
        return self.values[130 + axis]

    def exceeds_travel(self, target_mm: tuple[float, ...]) -> bool:
        """Whether a target lies outside machine coordinates -travel to 0 of any axis."""
        return any(t > 0.0 or t < -self.max_travel_mm(i) for i, t in enumerate(target_mm))
