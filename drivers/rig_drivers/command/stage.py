"""A linear stage that a program of the user's own moves."""

import math
import threading
from collections.abc import Mapping, Sequence
from typing import Self

from rig.devices import Clock
from rig.errors import (
    ConfigError,
    DeviceError,
    DeviceLostError,
    StageAlarmError,
    StagePositionError,
    StageTimeoutError,
)
from rig.profile import CommandStageConfig
from rig_drivers.command.answer import Answer, NoAnswerError, read_answer
from rig_drivers.command.program import Program, Running
from rig_drivers.stage.travel import check_inside

SLICE_S = 0.05
"""Longest wait before somebody who wants to stop the stage is heard."""
PAGE = "see docs/how-to/command-stage.md"


class CommandStage:
    """Keeps `rig.devices.Stage`.

    The program is asked `move MM`, `position` and `stop`, a process for each; a move has ended when
    `move` has, and then `position` must agree. Whatever ends a move early is followed by `stop`.
    """

    def __init__(
        self, config: CommandStageConfig, clock: Clock, program: Program, *, name: str = "stage"
    ) -> None:
        self._config = config
        self._clock = clock
        self._program = program
        self._name = name
        self._lock = threading.RLock()
        self._stops = 0
        self._is_open = self._is_homed = False

    def __enter__(self) -> Self:
        """See that the program can stop and tell the position.

        Raises:
            DeviceNotFoundError: there is no such program.
            ConfigError: it has no `stop`.
            DeviceError: it fails.
        """
        self._is_homed = False
        try:
            self._ask_to_stop()
        except (StageAlarmError, StageTimeoutError) as error:
            raise ConfigError(
                f"{self._name}: a stage that cannot be stopped is refused: {error.symptom}",
                advice='give the program a `stop` that answers {"stopped": true}: ' + PAGE,
            ) from error
        self._position()
        self._is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the stage."""
        try:
            self.stop()
        finally:
            self._is_open = False

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": self._config.kind, "command": " ".join(self._config.command)}

    @property
    def travel_mm(self) -> tuple[float, float]:
        """See `Stage.travel_mm`."""
        return self._config.travel_mm

    @property
    def position_mm(self) -> float:
        """See `Stage.position_mm`."""
        with self._lock:
            self._check_open()
            if not self._is_homed:
                raise self._not_known("home the stage first")
            return self._known_mm()

    def home(self) -> None:
        """See `Stage.home`: the program must know the position; finding it is its own business.

        Raises:
            ConfigError: the profile forbids moving.
        """
        with self._lock:
            self._check_open()
            self._check_may_move("asked to home")
            self._known_mm()
            self._is_homed = True

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """See `Stage.move_to`.

        Raises:
            ConfigError: the profile forbids moving.
        """
        check_inside(self._config.travel_mm, position_mm, device=self._name)
        self._check_may_move(f"asked for {position_mm:.3f} mm")
        with self._lock:
            begun_at, deadline_s = self._stops, self._clock.now_s() + timeout_s
            here_mm = self.position_mm
            before_mm = position_mm - self._config.approach_mm
            if self._config.approach_mm and here_mm > before_mm:
                self._go(before_mm, deadline_s, begun_at)
            return self._go(position_mm, deadline_s, begun_at)

    def stop(self) -> None:
        """See `Stage.stop`; from any thread: `stop` runs beside a `move` at work.

        Raises:
            DeviceLostError: the program does not say that the stage stands.
        """
        if not self._is_open:
            return
        self._stops += 1
        self._stop_for_sure("asked to stop")
        with self._lock:
            return  # a move under way has given up now

    # -- moving -------------------------------------------------------------------------------

    def _go(self, wanted_mm: float, deadline_s: float, begun_at: int) -> float:
        left_s = max(0.0, deadline_s - self._clock.now_s())
        what = f"asked for {wanted_mm:.3f} mm within {left_s:.1f} s"
        try:
            self._ask(("move", f"{wanted_mm:.4f}"), left_s, what, begun_at)
            reached_mm = self._known_mm()
        except BaseException:
            self._stop_for_sure(what)
            raise
        tolerance_mm = self._config.tolerance_mm
        if not math.isclose(reached_mm, wanted_mm, rel_tol=0.0, abs_tol=tolerance_mm):
            raise StagePositionError(
                self._name, wanted_mm=wanted_mm, reached_mm=reached_mm, tolerance_mm=tolerance_mm
            )
        return reached_mm

    def _stop_for_sure(self, what: str) -> None:
        try:
            self._ask_to_stop()
        except DeviceError as error:
            raise DeviceLostError(
                self._name,
                f"{what}; could not be stopped: {error.symptom}",
                advice="the stage may still be moving: switch its supply off",
            ) from error

    # -- asking -------------------------------------------------------------------------------

    def _ask_to_stop(self) -> None:
        answer = self._answer_in_time(("stop",))
        if not answer.is_stopped:
            raise self._wrong("stop", f"found {answer}")

    def _position(self) -> float | None:
        answer = self._answer_in_time(("position",))
        if answer.is_stopped:
            raise self._wrong("position", "found no position_mm")
        return answer.position_mm

    def _known_mm(self) -> float:
        position_mm = self._position()
        if position_mm is None:
            self._is_homed = False
            raise self._not_known("let the program find its reference")
        return position_mm

    def _answer_in_time(self, arguments: Sequence[str]) -> Answer:
        timeout_s = self._config.answer_timeout_s
        what = f"asked `{arguments[0]}` within {timeout_s:.1f} s"
        return self._ask(arguments, timeout_s, what)

    def _ask(
        self, arguments: Sequence[str], timeout_s: float, what: str, begun_at: int | None = None
    ) -> Answer:
        """Run the program once.

        Args:
            arguments: what is asked.
            timeout_s: the program is killed after it.
            what: for the error.
            begun_at: count of stops at which this began: it ends when somebody stops the stage;
                None: it does not heed that.
        """
        deadline_s = self._clock.now_s() + timeout_s
        running = self._program.start(arguments)
        try:
            done = self._await(running, deadline_s, begun_at)
        except BaseException:
            running.kill()
            raise
        if done is None:
            running.kill()
            raise StageTimeoutError(
                self._name,
                f"{what}, the program did not answer `{' '.join(arguments)}`, ended",
                advice="allow more time (sweep.move_timeout_s, stage.answer_timeout_s), or see "
                "what it waits for",
                timeout_s=timeout_s,
            )
        return self._read(arguments[0], *done)

    def _await(
        self, running: Running, deadline_s: float, begun_at: int | None
    ) -> tuple[int, str, str] | None:
        """Return what a call gave; None at the deadline."""
        while (done := running.output(SLICE_S)) is None:
            self._check_not_stopped(begun_at)
            if self._clock.now_s() >= deadline_s:
                return None
        self._check_not_stopped(begun_at)
        return done

    def _read(self, word: str, code: int, said: str, complained: str) -> Answer:
        last = complained.strip().splitlines()[-1:] or [""]
        try:
            answer = read_answer(said)
        except NoAnswerError as error:
            note = f", exit code {code}" if code else ""
            note += f", {last[0][:200]!r}" if last[0] else ""
            raise self._wrong(word, f"found {error}{note}") from error
        if answer.error is not None:
            raise StageAlarmError(
                self._name,
                f"the program says of `{word}`: {answer.error[:200]}",
                advice="see to what it says, then home again",
                code="error",
            )
        if code:
            raise self._wrong(word, f"exit code {code} {last[0][:200]!r}")
        return answer

    # -- errors -------------------------------------------------------------------------------

    def _wrong(self, word: str, found: str) -> StageAlarmError:
        return StageAlarmError(
            self._name,
            f"asked the program `{word}`, {found}",
            advice=f"it must answer with one line of JSON and exit code 0: {PAGE}",
            code="no answer",
        )

    def _check_not_stopped(self, begun_at: int | None) -> None:
        if begun_at is not None and self._stops != begun_at:
            raise StageAlarmError(
                self._name,
                "stopped on request",
                advice="move again when it is safe",
                code="stopped",
            )

    def _not_known(self, advice: str) -> StageAlarmError:
        return StageAlarmError(
            self._name, "the position is not known", advice=f"{advice}, then home", code="not homed"
        )

    def _check_open(self) -> None:
        if not self._is_open:
            raise DeviceLostError(self._name, "is not open", advice="use it inside `with`")

    def _check_may_move(self, what: str) -> None:
        if not self._config.may_move:
            raise ConfigError(
                f"{self._name}: {what}, stage.may_move is false",
                advice="clear the way of the carriage and set it to true",
            )
