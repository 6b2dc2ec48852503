"""A GRBL controller's own settings, and whether they allow what a profile asks for."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.errors import ConfigError
from rig.profile import GrblStageConfig
from rig_drivers.grbl.dialect import AXES, Dialect
from rig_drivers.grbl.homing import fluidnc_homing_time_s, homing_time_s
from rig_drivers.stage.travel import check_speed, check_travel


@dataclass(frozen=True, slots=True)
class GrblAxis:
    """What the controller is set to on the axis that carries the board."""

    rate_mm_s: float
    """Fastest motion."""
    acceleration_mm_s2: float
    range_mm: tuple[float, float]
    """Machine coordinates that the soft limits allow."""
    home_mm: float
    """Machine coordinate at which homing ends."""
    homing_s: float | None = None
    """How long homing takes from the far end of the travel; None where nothing tells."""


def read_axis(
    settings: Mapping[int, float], options: str, config: GrblStageConfig, *, device: str
) -> GrblAxis:
    """Return what the settings say about the profile's axis.

    Args:
        settings: the values of `$$` by number.
        options: the letters of `[OPT:...]`; `Z` means that machine zero is where homing ends.
        config: names the axis.
        device: name used in errors.

    Raises:
        ConfigError: a setting is missing, or not as a measuring stage needs it.
    """
    axis = AXES.index(config.axis)
    needed = {13, 20, 22, 23, 27, *(base + axis for base in (110, 120, 130))}
    missing = sorted(needed - set(settings))
    if missing:
        raise ConfigError(
            f"{device}: the controller has no setting "
            f"{', '.join(f'${number}' for number in missing)}",
            advice="this driver needs GRBL 1.1",
        )
    for number, wanted, purpose in (
        (22, 1, "homing must be on, or no position is known"),
        (20, 1, "soft limits must be on, so that the controller refuses what is too far"),
        (13, 0, "reports must be in mm"),
    ):
        if int(settings[number]) & 1 != wanted:
            raise ConfigError(
                f"{device}: the controller has ${number}={settings[number]:.0f}, {purpose}",
                advice=f"send ${number}={wanted}",
            )
    travel_mm, pull_off_mm = settings[130 + axis], settings[27]
    homes_down = bool(int(settings[23]) >> axis & 1)
    if "Z" in options:
        range_mm = (0.0, travel_mm) if homes_down else (-travel_mm, 0.0)
        home_mm = 0.0
    else:
        range_mm = (-travel_mm, 0.0)
        home_mm = pull_off_mm - travel_mm if homes_down else -pull_off_mm
    homing_s = homing_time_s(settings, travel_mm)
    return GrblAxis(settings[110 + axis] / 60.0, settings[120 + axis], range_mm, home_mm, homing_s)


HOLDS = 255
"""$1: the motor keeps its current."""


def motor_at_rest(settings: Mapping[int, float]) -> dict[str, str]:
    """Return what to tell of a motor that loses its current after every move, else nothing."""
    off_ms = settings.get(1, HOLDS)
    return _lets_go(off_ms, f"$1={off_ms:.0f}", f"send $1={HOLDS}")


FLUIDNC_IDLE = "/stepping/idle_ms"
"""FluidNC's $1."""


def fluidnc_motor_at_rest(idle_ms: str) -> dict[str, str]:
    """Return the same for FluidNC; nothing where it does not tell."""
    if not idle_ms.isdecimal():
        return {}
    advice = f"set it to {HOLDS} in its configuration file"
    return _lets_go(float(idle_ms), f"{FLUIDNC_IDLE} {idle_ms}", advice)


def _lets_go(off_ms: float, setting: str, advice: str) -> dict[str, str]:
    if off_ms >= HOLDS:
        return {}
    told = f"off {off_ms:.0f} ms after every move ({setting}), which may cost steps"
    return {"motor": f"{told}: {advice}"}


FLUIDNC_KEYS = (
    "soft_limits",
    "max_rate_mm_per_min",
    "acceleration_mm_per_sec2",
    "max_travel_mm",
    "homing/mpos_mm",
    "homing/positive_direction",
)
"""Where FluidNC keeps what other dialects have as numbered settings, below `/axes/x/`."""


def read_fluidnc_axis(
    values: Mapping[str, str], config: GrblStageConfig, *, device: str
) -> GrblAxis:
    """Return what FluidNC's configuration says about the profile's axis.

    Args:
        values: the answers by key of `FLUIDNC_KEYS` and, for the time of homing, of
            `FLUIDNC_HOMING_KEYS`.
        config: names the axis.
        device: name used in errors.

    Raises:
        ConfigError: a value is missing, or not as a measuring stage needs it.
    """
    where = f"/axes/{config.axis.lower()}"
    missing = [key for key in FLUIDNC_KEYS if not values.get(key)]
    if len(missing) == len(FLUIDNC_KEYS):
        raise ConfigError(
            f"{device}: FluidNC knows nothing of {where}, so its configuration has no axis "
            f"{config.axis}, or it was not loaded",
            advice="see its boot messages ($SS), and name the axis in its configuration file",
        )
    if missing:
        raise ConfigError(
            f"{device}: FluidNC has no {where}/{missing[0]}",
            advice="give the axis homing and limits in its configuration file",
        )
    if values["soft_limits"] != "true":
        raise ConfigError(
            f"{device}: FluidNC has {where}/soft_limits {values['soft_limits']}",
            advice="set it to true in "
            "its configuration file, so that the controller refuses what is too far",
        )
    try:
        rate, acceleration, travel_mm, home_mm = (float(values[key]) for key in FLUIDNC_KEYS[1:5])
    except ValueError as error:
        raise ConfigError(
            f"{device}: FluidNC's {where} holds what is no number: {error}",
            advice="correct its configuration file",
        ) from error
    is_up = values["homing/positive_direction"] == "true"
    range_mm = (home_mm - travel_mm, home_mm) if is_up else (home_mm, home_mm + travel_mm)
    homing_s = fluidnc_homing_time_s(values, travel_mm)
    return GrblAxis(rate / 60.0, acceleration, range_mm, home_mm, homing_s)


@dataclass(frozen=True, slots=True)
class SettingNames:
    """What a controller calls its settings of one axis."""

    rate: str
    acceleration: str
    travel: str
    search: str

    @classmethod
    def of(cls, dialect: Dialect, axis: str) -> "SettingNames":
        """Return the numbers of GRBL, or the keys of FluidNC's configuration file."""
        if dialect is Dialect.FLUIDNC:
            where = f"/axes/{axis.lower()}"
            _, rate, acceleration, travel, *_ = (f"{where}/{key}" for key in FLUIDNC_KEYS)
            return cls(rate, acceleration, travel, f"{where}/homing/seek_mm_per_min")
        number = AXES.index(axis)
        return cls(f"${110 + number}", f"${120 + number}", f"${130 + number}", "$25")


def check_axis(
    config: GrblStageConfig, axis: GrblAxis, *, device: str, dialect: Dialect = Dialect.GRBL
) -> None:
    """See that the controller lets the stage go everywhere, and as fast, as the profile says.

    Raises:
        ConfigError: it does not.
    """
    names = SettingNames.of(dialect, config.axis)
    if axis.acceleration_mm_s2 <= 0.0:
        raise ConfigError(
            f"{device}: the controller's {names.acceleration} is {axis.acceleration_mm_s2:.1f} "
            "mm/s2",
            advice="set an acceleration above 0",
        )
    check_speed(config, axis.rate_mm_s, setting=names.rate, device=device)
    check_travel(config, axis.range_mm, setting=names.travel, device=device)
    if axis.homing_s is not None and axis.homing_s > config.homing_timeout_s:
        raise ConfigError(
            f"{device}: homing takes up to {axis.homing_s:.0f} s ({names.travel}, search speed "
            f"{names.search}), homing_timeout_s is {config.homing_timeout_s:.1f}",
            advice=f"raise {names.search} (mm per minute) or homing_timeout_s",
        )
