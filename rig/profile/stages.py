"""Stages in a profile: one closed model per kind, told apart by `kind`."""

from typing import Literal, Self

from pydantic import Field, model_validator

from rig.profile.model import Model, NotNegative, Positive, Span


class GrblStageConfig(Model):
    """A linear stage behind a GRBL 1.1 controller."""

    kind: Literal["grbl"]
    """Selects the GRBL 1.1 protocol."""
    port: str
    """Serial port: a device path, or a pyserial URL such as `socket://host:port`."""
    baud: int = Field(default=115200, gt=0)
    """Bits per second."""
    axis: Literal["X", "Y", "Z"] = "X"
    """The controller's axis that carries the board."""
    travel_mm: Span
    """Nearest and farthest distance the board may be sent to. Because of `approach_mm` the carriage
    itself goes that much nearer; opening checks that the controller's own limits leave the room."""
    distance_at_machine_zero_mm: float
    """Distance of the board from the reference camera at machine coordinate 0."""
    direction: Literal[1, -1] = 1
    """1: distance grows with the machine coordinate; -1: it shrinks."""
    speed_mm_s: Positive = 50.0
    """Speed of moves."""
    acceleration_mm_s2: Positive = 200.0
    """Acceleration set in the controller; used only to estimate times."""
    approach_mm: NotNegative = 2.0
    """Every position is approached from the near side over this distance: backlash cancels."""
    tolerance_mm: Positive = 0.02
    """Largest difference between the position asked for and the one read back."""
    may_home: bool = True
    """Whether opening may move the stage to its reference switch."""
    homing_timeout_s: Positive = 60.0
    """Longest wait for homing."""

    @model_validator(mode="after")
    def _travel_has_a_length(self) -> Self:
        if not self.travel_mm[0] < self.travel_mm[1]:
            low_mm, high_mm = self.travel_mm
            raise ValueError(f"travel_mm runs from {low_mm} to {high_mm}; give nearest, farthest")
        return self


StageConfig = GrblStageConfig
