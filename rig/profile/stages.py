"""Stages in a profile: one closed model per kind, told apart by `kind`."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from rig.profile.model import Model, NotNegative, Positive, Span


class StageConfig(Model):
    """What every kind of stage has, and what a run may ask of it without knowing the kind."""

    kind: Any
    """Selects the kind; every kind narrows it to a literal of its own."""
    carries: Literal["board", "camera"] = "board"
    """What moves with it: the board of `[stage]` or `[stages.board]`, or the one camera of a scan,
    `[stages.camera]` and `[stages.column]`. Positions of a camera are counted as distances of a
    board are, and may be negative."""
    travel_mm: Span
    """Nearest and farthest distance the board may be sent to."""
    speed_mm_s: Positive = 50.0
    """Speed of moves."""
    acceleration_mm_s2: Positive = 200.0
    """Acceleration of moves; used only to estimate times."""
    approach_mm: NotNegative = 0.0
    """Every position is approached from the near side over this distance: backlash cancels."""
    may_move: bool = True
    """Whether the stage may be moved at all: a run begins with a way to the reference switch.
    `false` until the way is clear; homing and moves are then refused."""

    @property
    def place(self) -> str:
        """What names this very stage in messages."""
        return str(self.kind)

    @property
    def is_simulated(self) -> bool:
        """Whether it moves in the profile's `world`."""
        return False

    @property
    def distance_sigma_mm(self) -> float:
        """Uncertainty (1 sigma) of a distance, where it is more than the stage's play."""
        return 0.0

    @model_validator(mode="after")
    def _travel_has_a_length(self) -> Self:
        if not self.travel_mm[0] < self.travel_mm[1]:
            low_mm, high_mm = self.travel_mm
            raise ValueError(f"travel_mm runs from {low_mm} to {high_mm}; give nearest, farthest")
        return self


class SerialStageConfig(StageConfig):
    """What every linear stage behind a serial port has, whatever it speaks."""

    port: str = Field(min_length=1)
    """Serial port: a device path (best the one in /dev/serial/by-id), `usb-serial:NUMBER` for the
    adapter with that USB serial number, or a pyserial URL such as `socket://host:port`."""
    baud: int = Field(default=115200, gt=0)
    """Bits per second."""
    dtr: bool | None = None
    """Level of the line DTR while the port is open; without it the system decides, which raises it
    and so resets most boards. `false` for boards that stay in reset otherwise."""
    rts: bool | None = None
    """The same of the line RTS."""
    travel_mm: Span
    """Nearest and farthest distance the board may be sent to. Because of `approach_mm` the carriage
    itself goes that much nearer; opening checks that the controller's own limits leave the room."""
    distance_at_machine_zero_mm: float
    """Distance of the board from the reference camera at machine coordinate 0."""
    direction: Literal[1, -1] = 1
    """1: distance grows with the machine coordinate; -1: it shrinks."""
    acceleration_mm_s2: Positive = 200.0
    """Acceleration set in the controller; used only to estimate times."""
    approach_mm: NotNegative = 2.0
    """Every position is approached from the near side over this distance: backlash cancels."""
    tolerance_mm: Positive = 0.02
    """Largest difference between the position asked for and the one read back."""
    homing_timeout_s: Positive = 60.0
    """Longest wait for homing."""
    motor_off_at_end: bool = False
    """Whether the motor loses its current when the stage is closed: it stays cool and turns by
    hand, and must be homed again."""

    @property
    def place(self) -> str:
        """See `StageConfig.place`."""
        return self.port

    @property
    def is_simulated(self) -> bool:
        """See `StageConfig.is_simulated`."""
        return self.port.startswith("sim://")


class GrblStageConfig(SerialStageConfig):
    """A linear stage behind a GRBL 1.1, grblHAL or FluidNC controller."""

    kind: Literal["grbl"]
    """Selects the GRBL 1.1 protocol."""
    axis: Literal["X", "Y", "Z"] = "X"
    """The controller's axis that carries the board."""


class ZaberStageConfig(SerialStageConfig):
    """A linear stage that speaks the Zaber ASCII protocol, alone or in a daisy chain."""

    kind: Literal["zaber"]
    """Selects the Zaber ASCII protocol."""
    device_address: int = Field(default=1, ge=1, le=99)
    """Number of the device in the chain."""
    axis_number: int = Field(default=1, ge=1, le=9)
    """The device's axis that carries the board."""
    microstep_mm: Positive
    """Way of one microstep: the lead of the spindle over full steps per turn and `resolution`; see
    the stage's data sheet."""
    replies_with_checksum: bool = True
    """Whether the device ends its replies with a checksum (its setting comm.checksum); `true`
    refuses replies without one."""


class MarlinStageConfig(SerialStageConfig):
    """A linear stage behind a Marlin 2 controller (a 3D printer's board)."""

    kind: Literal["marlin"]
    """Selects Marlin's dialect of G-code."""
    axis: Literal["X", "Y", "Z"] = "X"
    """The controller's axis that carries the board."""


class ManualStageConfig(StageConfig):
    """No stage at all: a person puts the board where rig says, along a ruler or a rail."""

    kind: Literal["manual"]
    """Selects the hand."""
    reading_sigma_mm: Positive = 0.5
    """Uncertainty (1 sigma) of where the board stands: of the reading and of the hand."""
    tolerance_mm: Positive = 5.0
    """How far from the asked distance the board may stand, where the true reading is typed in."""
    patience_s: Positive = 900.0
    """A person has at least so long for each distance, whatever `sweep.move_timeout_s` says."""

    @property
    def distance_sigma_mm(self) -> float:
        """See `StageConfig.distance_sigma_mm`."""
        return self.reading_sigma_mm


class CommandStageConfig(StageConfig):
    """A stage behind a program of your own, which moves it, tells where it is, and stops it."""

    kind: Literal["command"]
    """Selects the program."""
    command: tuple[str, ...] = Field(min_length=1)
    """The program and its first arguments; no shell reads them. `move MM`, `position` or `stop` is
    added, and each answers with one line of JSON."""
    tolerance_mm: Positive = 0.05
    """Largest difference between the position asked for and the one read back."""
    answer_timeout_s: Positive = 5.0
    """Longest wait for the answer to `position` and `stop`; `move` has as long as the run says."""

    @property
    def place(self) -> str:
        """See `StageConfig.place`."""
        return " ".join(self.command)
