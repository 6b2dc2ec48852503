"""What the simulated GRBL prints about itself."""

from dataclasses import dataclass
from enum import Enum

from rig_sim.firmware.axes import Vector
from rig_sim.firmware.grbl.gcode import MM_PER_INCH, Modes
from rig_sim.firmware.grbl.settings import GrblSettings

BANNERS = {
    "grbl": "\r\nGrbl 1.1h ['$' for help]\r\n",
    "grblhal": "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n",
    "fluidnc": "\r\nGrbl 3.7 [FluidNC v3.7.18 (noradio) '$' for help]\r\n",
}
BUILD_INFO = {
    "grbl": ("[VER:1.1h.20190830:]", "[OPT:V,15,128]"),
    "grblhal": (
        "[VER:1.1f.20240812:]",
        "[OPT:VNMSL,35,1024,3,0]",
        "[AXS:3:XYZ]",
        "[NEWOPT:ENUMS,RT+,HOME,SED]",
        "[FIRMWARE:grblHAL]",
        "[NVS STORAGE:*FLASH]",
        "[DRIVER VERSION:240805]",
    ),
    "fluidnc": ("[VER:3.7 FluidNC v3.7.18 (noradio):]", "[OPT:MPHS]"),
}
HELP = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]"

WCO_EVERY = {False: 10, True: 30}
"""Reports from one work offset to the next: at rest, and busy."""
OV_EVERY = {False: 10, True: 20}


class State(Enum):
    """The machine state, named as in status reports."""

    IDLE = "Idle"
    ALARM = "Alarm"
    HOMING = "Home"
    CYCLE = "Run"
    HOLD = "Hold"
    JOG = "Jog"
    SLEEP = "Sleep"

    @property
    def is_busy(self) -> bool:
        """Whether something moves or is held."""
        return self not in {State.IDLE, State.ALARM, State.SLEEP}


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What a status report tells."""

    state: State
    is_held: bool
    """In `Hold`: whether it has come to rest."""
    position_mm: Vector
    offset_mm: Vector
    speed_mm_s: float
    free_blocks: int
    free_bytes: int
    switch: str
    """Letter of the axis whose switch is closed, or nothing."""


class StatusReports:
    """Prints status reports; work offset and overrides come only now and then."""

    def __init__(self, settings: GrblSettings) -> None:
        self._settings = settings
        self._until_wco = 0
        self._until_ov = 0

    def refresh_offset(self) -> None:
        """Tell the work offset with the next report."""
        self._until_wco = 0

    def line(self, now: Snapshot) -> str:
        """Return one report."""
        detail = ":" + ("0" if now.is_held else "1") if now.state is State.HOLD else ""
        mask = int(self._settings.values[10])
        fields = [now.state.value + detail]
        if mask & 1:
            fields.append("MPos:" + self._vector(now.position_mm))
        else:
            pairs = zip(now.position_mm, now.offset_mm, strict=True)
            work_mm = [position - offset for position, offset in pairs]
            fields.append("WPos:" + self._vector((work_mm[0], work_mm[1], work_mm[2])))
        if mask & 2:
            fields.append(f"Bf:{now.free_blocks},{now.free_bytes}")
        if self._settings.dialect == "grblhal" and now.state is State.ALARM:
            fields[0] += ":11"
        fields.append(f"FS:{now.speed_mm_s * 60.0 / self._unit_mm:.0f},0")
        if self._settings.dialect == "grblhal":
            fields.append("SP1:0,,")
        if now.switch:
            fields.append("Pn:" + now.switch)
        fields += self._now_and_then(now)
        return "<" + "|".join(fields) + ">"

    def _now_and_then(self, now: Snapshot) -> list[str]:
        fields: list[str] = []
        if self._until_wco > 0:
            self._until_wco -= 1
        else:
            self._until_wco = WCO_EVERY[now.state.is_busy] - 1
            self._until_ov = max(self._until_ov, 1)
            fields.append("WCO:" + self._vector(now.offset_mm))
        if self._until_ov > 0:
            self._until_ov -= 1
        else:
            self._until_ov = OV_EVERY[now.state.is_busy] - 1
            fields.append("Ov:100,100,100")
            if self._settings.dialect == "grblhal":
                fields += ["AR", "$C:1"]
        return fields

    @property
    def _unit_mm(self) -> float:
        return MM_PER_INCH if self._settings.in_inches else 1.0

    def _vector(self, values_mm: Vector) -> str:
        decimals = 4 if self._settings.in_inches else 3
        return ",".join(f"{value / self._unit_mm:.{decimals}f}" for value in values_mm)


def parameter_lines(offset_mm: Vector) -> list[str]:
    """Return the answer to `$#`; only the G92 offset is ever other than zero."""
    zero = "0.000,0.000,0.000"
    names = ("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30")
    offset = ",".join(f"{value:.3f}" for value in offset_mm)
    systems = [f"[{name}:{zero}]" for name in names]
    return [*systems, f"[G92:{offset}]", "[TLO:0.000]", f"[PRB:{zero}:0]"]


def modes_line(modes: Modes) -> str:
    """Return the answer to `$G`."""
    return (
        f"[GC:G{modes.motion} G54 G17 G{20 if modes.inches else 21} "
        f"G{91 if modes.incremental else 90} G94 M5 M9 T0 F{modes.feed_mm_min:.0f} S0]"
    )
