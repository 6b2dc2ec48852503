"""What each serial protocol brings to a stage: the contract between the two."""

from collections.abc import Mapping
from typing import Protocol


class Controller(Protocol):
    """One axis of a controller, in its own coordinates: what each serial protocol brings.

    Every method but `cancel` and `resume` is called with the stage's lock held. Whatever the
    controller says of itself, an alarm or a reset, is raised as StageAlarmError by the method that
    hears it.
    """

    def connect(self) -> Mapping[str, str]:
        """Learn who and what is behind the port that has just been opened.

        Returns:
            What tells this controller from another one.

        Raises:
            DeviceNotFoundError: it does not speak this protocol.
            ConfigError: its settings do not allow what the profile asks for.
        """
        ...

    @property
    def is_homed(self) -> bool:
        """Whether its coordinates mean anything."""
        ...

    def begin(self) -> None:
        """Begin a call; raises if a stop is still under way."""
        ...

    def rest_mm(self, what: str, timeout_s: float) -> float | None:
        """Wait for rest and return the coordinate, read twice alike; None if there is no rest.

        Args:
            what: what was asked of the stage, for the error.
            timeout_s: longest wait for rest.

        Raises:
            StageAlarmError: it stands, but not because it has arrived.
            StageTimeoutError: it does not answer.
        """
        ...

    def move(self, machine_mm: float) -> None:
        """Start one straight motion."""
        ...

    def confirm_end(self) -> None:
        """Make the controller prove that nothing it was told to do is left."""
        ...

    def home(self, timeout_s: float) -> float:
        """Find the reference and return the coordinate at which that must have ended."""
        ...

    def trust(self) -> None:
        """Take note that homing has ended where it should."""
        ...

    def halt(self) -> None:
        """Bring the axis to rest and clear every queued motion.

        Raises:
            DeviceLostError: the controller does not confirm that it stands.
        """
        ...

    def cancel(self) -> None:
        """Stop the motion and make the call under way give up; from any thread."""
        ...

    def resume(self) -> None:
        """Let new calls begin after `cancel`."""
        ...

    def motor_off(self) -> None:
        """Take the current off the motor of an axis at rest."""
        ...
