"""The live page of a sweep: the board as it is seen, and the curve as it grows."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.frames import GreyImage, MultiView
from rig.measurement import Measurement
from rig.records import SampleKey
from rig.sweep.conclude import SweepResult
from rig.sweep.job import SweepJob
from rig.sweep.take import NewSample
from rig.view.hand import PageHand
from rig.view.packing import as_8_bit
from rig.view.server import ViewServer
from rig.view.wire import encode

_CURVE_POINTS = 121


@dataclass(frozen=True, slots=True)
class SweepMessage:
    """A sweep at one moment; pictures are worked out for those who look only."""

    header: Mapping[str, Any]
    job: SweepJob
    newest: MultiView | None
    """What was taken last."""
    board: MultiView | None
    """What was measured last: the corners of the header are of its pictures."""

    def encoded(self, number: int, wants: frozenset[str]) -> bytes:
        """Return header and arrays: `view_0`, `view_1`, ... as taken last, `image` as measured."""
        arrays: dict[str, NDArray[Any]] = {}
        if self.newest is not None and "views" in wants:
            for i, one in enumerate(self.newest.frames):
                arrays[f"view_{i}"] = as_8_bit(one.image, one.full_scale.bit_length())
        if self.board is not None:
            reference = self.job.run.profile.reference
            bits = self.board.frames[reference].full_scale.bit_length()
            arrays["image"] = as_8_bit(self._board_picture(self.board), bits)
        return encode({"mode": "sweep", "number": number, **self.header}, arrays)

    def _board_picture(self, board: MultiView) -> GreyImage:
        run = self.job.run
        if run.optics.calibration_id is None:
            return board.frames[run.profile.reference].image
        return run.optics.pictures(board.images)[run.profile.reference]


@dataclass(slots=True)
class _Known:
    """What is known of a sweep so far."""

    done: int
    at: int | None = None
    """Index of the stop where the stage is."""
    sample: int | None = None
    points: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    failures: int = 0
    last: Measurement | None = None
    waiting: dict[SampleKey, NewSample] = field(default_factory=dict[SampleKey, NewSample])
    newest: MultiView | None = None
    board: MultiView | None = None
    result: SweepResult | None = None


class SweepView:
    """Shows a sweep to whoever looks on; a `SweepWatcher`.

    Args:
        server: started; closed by whoever started it.
        hand: what it asks of the person at the page is shown.
    """

    def __init__(self, server: ViewServer[SweepMessage], hand: PageHand | None = None) -> None:
        self._server = server
        self._hand = PageHand() if hand is None else hand
        self._hand.on_change = self._publish
        self._job: SweepJob | None = None
        self._known = _Known(0)

    def begins(self, job: SweepJob, done: int) -> None:
        """Show the plan."""
        self._job, self._known = job, _Known(done)
        self._publish()

    def took(self, new: NewSample, key: SampleKey) -> None:
        """Show the newest pictures."""
        known = self._known
        known.done += 1
        known.at, known.sample, known.newest = new.stop.index, new.sample, new.multiview
        known.waiting[key] = new
        self._publish()

    def measured(self, measurements: Mapping[SampleKey, Measurement]) -> None:
        """Show slopes beside those that are there, and where the corners were found."""
        for key, measurement in measurements.items():
            self._add(key, measurement)
        if measurements:
            self._publish()

    def concluded(self, result: SweepResult) -> None:
        """Show the curve and what it errs by where it was not fitted."""
        self._known.result = result
        self._publish()

    def _add(self, key: SampleKey, measurement: Measurement) -> None:
        known, new = self._known, self._known.waiting.pop(key, None)
        known.last = measurement
        known.failures += measurement.slope_px is None
        if new is None:  # taken before the sweep was interrupted
            return
        known.board = new.multiview
        if measurement.slope_px is not None:
            known.points.append(
                {
                    "mm": new.reached_mm,
                    "px": measurement.slope_px,
                    "role": new.stop.role,
                    "direction": new.stop.direction,
                }
            )

    def _publish(self) -> None:
        if self._job is None:
            return
        known = self._known
        header = {**_plan(self._job, known), **_seen(known), "result": _result(known.result)}
        header["asked"] = self._hand.asked
        self._server.publish(SweepMessage(header, self._job, known.newest, known.board))


def _plan(job: SweepJob, known: _Known) -> dict[str, Any]:
    profile = job.run.profile
    return {
        "rig": profile.name,
        "stops": [
            {"mm": stop.distance_mm, "role": stop.role, "direction": stop.direction}
            for stop in job.stops
        ],
        "samples": job.samples,
        "at": known.at,
        "sample": known.sample,
        "done": known.done,
        "total": job.total,
        "reference": profile.reference,
        "x_steps": job.run.optics.x_steps.tolist(),
        "y_steps": job.run.optics.y_steps.tolist(),
        "views": [{"name": view.name} for view in profile.views],
    }


def _seen(known: _Known) -> dict[str, Any]:
    last = known.last
    corners = () if last is None or last.corners_px is None else last.corners_px
    return {
        "points": list(known.points),
        "failures": known.failures,
        "corners": [list(corner) for row in corners for corner in row],
        "outline": [] if last is None else [list(point) for point in last.outline_px or ()],
        "problem": None if last is None or last.failure is None else last.failure.message,
        "residual_px": None if last is None else last.track_residual_px,
    }


def _result(result: SweepResult | None) -> dict[str, Any] | None:
    if result is None:
        return None
    curve, holdout = result.fit.best, result.fit.holdout
    at_mm = np.linspace(*curve.valid_mm, _CURVE_POINTS)
    slope_px = curve.slope_px(at_mm)
    known = np.isfinite(slope_px)
    return {
        "headline": str(result.headline),
        "model": curve.model,
        "curve": np.column_stack([at_mm, slope_px])[known].tolist(),
        "holdout": []
        if holdout is None
        else [[one.point.distance_mm, one.error_mm] for one in holdout.residuals],
        "rms_mm": None if holdout is None else holdout.rms_mm,
        "gates": list(result.failed_gates),
    }
