"""A true stage before a simulated camera: the simulated board stands where the stage reports."""

import threading
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from rig.devices import Stage
from rig.errors import DeviceError
from rig.profile import CarriageConfig


class RehearsedStage:
    """A stage that is there, with a board that is simulated; keeps `Stage` and is a carriage.

    The board's distance is what the stage reports, with its sign, home and travel as the profile
    says them, times `world.carriage.scale`: a world may know better than the stage. A picture asks
    the stage where it is; while the stage is at work (a move, homing) the board stands where it was
    reported last, and before the first report where the world's carriage stands when power comes.

    Args:
        stage: closed; opened and closed with this one.
        config: the carriage of the world.
    """

    def __init__(self, stage: Stage, config: CarriageConfig) -> None:
        self._stage = stage
        self._config = config
        self._at_work = threading.Lock()
        self._reported_mm: float | None = None
        self._is_open = False

    def __enter__(self) -> Self:
        self._reported_mm = None
        self._stage.__enter__()
        self._is_open = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._is_open = False
        with self._at_work:
            self._stage.__exit__(kind, error, trace)

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return self._stage.identity

    @property
    def travel_mm(self) -> tuple[float, float]:
        """See `Stage.travel_mm`."""
        return self._stage.travel_mm

    @property
    def position_mm(self) -> float:
        """See `Stage.position_mm`."""
        with self._at_work:
            return self._seen()

    def home(self) -> None:
        """See `Stage.home`."""
        with self._at_work:
            self._stage.home()
            self._seen()

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`."""
        with self._at_work:
            self._reported_mm = self._stage.move_to(position_mm, timeout_s)
            return self._reported_mm

    def stop(self) -> None:
        """See `Stage.stop`; never waits for a move to end."""
        self._stage.stop()

    def travelled_mm(self, t_s: float) -> float:
        """See `rig_sim.world.Carriage`; the present counts, whatever `t_s` is."""
        del t_s
        if self._at_work.acquire(blocking=False):
            try:
                self._ask()
            finally:
                self._at_work.release()
        if self._reported_mm is None:
            return self._config.power_up_mm
        return self._config.scale * self._reported_mm - self._config.board_at_machine_zero_mm

    def _ask(self) -> None:
        """Ask where it is; what the stage cannot tell now leaves the board where it was."""
        if not self._is_open:
            return
        try:
            self._seen()
        except (
            DeviceError
        ):  # whoever drives the stage is told when it is next asked to do something
            return

    def _seen(self) -> float:
        self._reported_mm = self._stage.position_mm
        return self._reported_mm
