"""One rig as a run uses it, and how far the curve of the run can be trusted."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from rig.curve import Curve
from rig.epipolar.mending.mending import Mending
from rig.epipolar.mending.row_errors import RowErrors
from rig.errors import CurveError
from rig.optics.optics import Optics
from rig.optics.prior import FACTORY
from rig.optics.search_range import search_range_px
from rig.profile import Profile
from rig.records import StoredCalibration
from rig.unit import unit_of

FROM_SCENE = "from_scene"
"""Key of the quality of a calibration that was made from pictures of ordinary scenes."""
_TOLD_AT_MM = 1000.0
_K = 2.0


@dataclass(frozen=True, slots=True)
class RunCurve:
    """The depth-slope curve that a run uses."""

    id: int | None
    """Number in the database; None for a curve that a program brought itself, or that follows from
    a calibration alone."""
    curve: Curve
    sweep_id: int | None
    """Where it comes from."""
    row_errors: RowErrors | None = None
    """What the rows of the views missed by when it was made; None where nobody looked."""
    alone: str | None = None
    """The calibration that it follows from, without any sweep: `factory` or `calibration 3`."""
    proven_mm: tuple[float, float] | None = None
    """Where it would be valid if `slopes.range_mm` did not end it earlier."""
    holdout_rms_mm: float | None = None
    """Rms error of the board's plane at the distances that its fit has not seen; None without."""
    camera: Mapping[str, object] = field(default_factory=dict[str, object], compare=False)
    """Identity of the camera that it was made with; empty where nothing is stored of it."""
    unit: str = ""
    """Which of the rigs of this name it was measured with; empty where nobody knows."""

    @property
    def title(self) -> str:
        """What messages call it."""
        if self.alone is not None:
            return f"the curve of {calibration_in_words(self.alone)}"
        return "the curve that was given" if self.id is None else f"curve {self.id}"

    @property
    def in_words(self) -> str:
        """Its title, and its error where no sweep has proven it."""
        if self.alone is None:
            return self.title
        at_mm, error_pct = self.error_pct
        return f"{self.title}, not proven: +-{error_pct:.2g} % at {at_mm / 1e3:.4g} m, k=2"

    @property
    def source(self) -> str:
        """Where it comes from, in a word and a number."""
        if self.alone is not None:
            return self.alone
        return "given" if self.sweep_id is None else f"sweep {self.sweep_id}"

    def as_dict(self) -> dict[str, object]:
        """Return what programs are told of it."""
        distance_mm, error_pct = self.error_pct
        return {
            "id": self.id,
            "source": self.source,
            "model": self.curve.model,
            "valid_mm": list(self.curve.valid_mm),
            "error": {"at_mm": distance_mm, "pct_k2": error_pct},
            "proven": self.alone is None,
        }

    @property
    def error_pct(self) -> tuple[float, float]:
        """A distance, 1 m where it is valid there, and the curve's own k=2 there, per cent."""
        near_mm, far_mm = self.curve.valid_mm
        at_mm = min(max(_TOLD_AT_MM, near_mm), far_mm)
        slope_px = self.curve.law.slope_px(np.array([at_mm]))
        sigma_px = float(self.curve.curve_sigma_px(np.array([at_mm]))[0])
        sigma_mm = sigma_px * -float(self.curve.law.depth_per_slope(slope_px)[0])
        return at_mm, _K * 100.0 * sigma_mm / at_mm

    def within(self, profile: Profile) -> "RunCurve":
        """Return the part of it in the distances that the profile looks for.

        Raises:
            CurveError: it is valid nowhere there.
        """
        wanted_mm, valid_mm = profile.slopes.range_mm, self.curve.valid_mm
        if wanted_mm is None:
            return self
        near_mm, far_mm = max(wanted_mm[0], valid_mm[0]), min(wanted_mm[1], valid_mm[1])
        if not near_mm < far_mm:
            raise CurveError(
                f"slopes.range_mm = [{wanted_mm[0]:g}, {wanted_mm[1]:g}] asked for, {self.title} "
                f"is valid {valid_mm[0]:.0f}-{valid_mm[1]:.0f} mm",
                advice="correct slopes.range_mm, or sweep these distances",
            )
        return replace(
            self, curve=replace(self.curve, valid_mm=(near_mm, far_mm)), proven_mm=valid_mm
        )

    def widened(self, mending: Mending, optics: Optics) -> "RunCurve":
        """Return it less sure by what the rows of the pictures miss by.

        Cameras that miss across the lines are turned, and are turned as far along them: there it is
        a slope. Views err alone, so that of the slope through all of them is
        `sum(s^2 rho^2) / sum(s^2)^2`, with steps s and misses rho.
        """
        steps2 = np.asarray(optics.x_steps) ** 2 + np.asarray(optics.y_steps) ** 2
        missed_px2 = np.asarray(mending.rows.rms_px) ** 2
        added_px2 = float(steps2 @ missed_px2) / float(steps2.sum()) ** 2
        covariance = np.array(self.curve.covariance)
        at = self.curve.law.fitted.index("m_inf_px")
        covariance[at, at] += added_px2
        rows = tuple(tuple(row) for row in covariance.tolist())
        return replace(self, curve=replace(self.curve, covariance=rows))


@dataclass(frozen=True, slots=True)
class Run:
    """One rig as a run uses it."""

    profile: Profile
    optics: Optics
    curve: RunCurve | None = None
    """None where slopes are wanted only."""
    calibration: StoredCalibration | None = None
    """What the optics come from; None for pictures as they are, or a device's own calibration."""
    awaits: Literal["slopes", "depth"] | None = None
    """What only the device's own calibration may tell, once it is open: see `completed_run`."""
    by_itself: tuple[tuple[str, str], ...] = ()
    """What it took that nobody named, as `curve 3`, each with the unit that it is of."""

    def require_unit(self, identity: Mapping[str, str]) -> None:
        """Refuse what was measured with another rig of the same name.

        Args:
            identity: what the open camera says of itself.

        Raises:
            CurveError: a curve or a calibration that was taken by itself is of another unit.
        """
        here = unit_of(self.profile, identity)
        for what, unit in self.by_itself:
            if here and unit and unit != here:
                kind, _, number = what.partition(" ")
                raise CurveError(
                    f"{what} of rig {self.profile.name} is of unit {unit}, this one is {here}",
                    advice=f'write unit = "{here}" into the profile, so that only its own are '
                    f"taken, or take this one on purpose with --{kind} {number}",
                )

    @property
    def range_px(self) -> tuple[float, float]:
        """Slopes to search, px per view step.

        Raises:
            ConfigError: the profile gives distances, and nothing tells which slopes these are.
        """
        return search_range_px(
            self.profile, self.optics, None if self.curve is None else self.curve.curve
        )

    def require_range(self) -> None:
        """Refuse distances that nothing turns into slopes, before any device is asked.

        Raises:
            ConfigError: see `range_px`.
        """
        search_range_px(self.profile, self.optics)

    @property
    def origin(self) -> str | None:
        """What must be said of its calibration wherever it is used; None for nothing."""
        return None if self.calibration is None else origin_of(self.calibration)

    @property
    def notices(self) -> tuple[str, ...]:
        """What a person should know of the curve before using its depth, one line each."""
        said: list[str] = [] if self.origin is None else [self.origin]
        curve, wanted_mm = self.curve, self.profile.slopes.range_mm
        if curve is not None and curve.alone is not None:
            at_mm, error_pct = curve.error_pct
            said.append(
                f"depth by {calibration_in_words(curve.alone)} alone, not proven: "
                f"+-{error_pct:.2g} % at {at_mm / 1e3:.4g} m, k=2; `rig sweep "
                f"{self.profile.name}` proves it"
            )
        if curve is not None and curve.proven_mm is not None and wanted_mm is not None:
            near_mm, far_mm = curve.proven_mm
            if wanted_mm[0] < near_mm or wanted_mm[1] > far_mm:
                said.append(
                    f"slopes.range_mm = [{wanted_mm[0]:g}, {wanted_mm[1]:g}] goes beyond "
                    f"{curve.title}, valid {near_mm:.0f}-{far_mm:.0f} mm: no depth outside of that"
                )
        return tuple(said)


def origin_of(calibration: StoredCalibration) -> str | None:
    """Return what must be said of a calibration wherever it is used; None for nothing."""
    if FROM_SCENE not in calibration.quality:
        return None
    return (
        f"calibration {calibration.id} is from a scene; lengths by the profile's pitch, not "
        "measured: a board tells them"
    )


def calibration_in_words(name: str) -> str:
    """Return what messages call the calibration of `RunCurve.alone`."""
    return "the factory's calibration" if name == FACTORY else name
