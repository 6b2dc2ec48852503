"""Whether rows that lie elsewhere are chance: one hypothesis after another of what has turned.

A pull towards three turns of one view is told from chance much sooner than one towards the turns of
all of them. So every view is asked alone, the reference among them, whose turn is one of all others
together; by Bonferroni's inequality, whatever the answers have in common, the probability is their
number times the least.

The reference's own errors are in all views: what they do to a hypothesis no single view tells. The
noise is therefore also taken from what parts of the picture pull towards that very hypothesis
(K.-Y. Liang and S. L. Zeger, "Longitudinal data analysis using generalized linear models",
Biometrika 73, 1986), and the larger one counts.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as fisher

from rig.arrays import Float
from rig.geometry.rig_geometry import RigGeometry


@dataclass(frozen=True, slots=True)
class Evidence:
    """What features tell about the P numbers of a calibration, up to their noise."""

    information: Float
    """(P, P) if features erred independently."""
    pull: Float
    """(P,) away from the calibration."""
    parts: Float
    """(C, P) what is left of the pull of each part of the picture once all is fitted."""
    noise: float
    """How much more parts of the picture differ than independent features would, over all views."""
    spare: int
    """Freedoms of that noise."""

    def against(self, unknown: Float, turning: Float, ratio: float) -> tuple[Float, Float]:
        """Information (K, K) and pull (K,) about turns, with what is not known in the noise.

        Args:
            unknown: (P, P) covariance of the calibration.
            turning: (P, K) how the turns move the numbers.
            ratio: how much more parts of the picture differ than independent features would.
        """
        information = self.information / ratio
        with_unknown = np.eye(len(information)) + information @ unknown
        told = turning.T @ np.linalg.solve(with_unknown, information @ turning)
        toward = turning.T @ np.linalg.solve(with_unknown, self.pull / ratio)
        return (told + told.T) / 2.0, toward

    def noise_of(self, turning: Float, told_rad: float) -> float:
        """Return the noise that parts of the picture show in some turns, 1 for independent ones.

        Args:
            turning: (P, K).
            told_rad: 1 sigma from which a turn is not told.
        """
        sizes, axes = np.linalg.eigh(turning.T @ self.information @ turning)
        clear = sizes > told_rad**-2.0
        if not clear.any():
            return 1.0
        pulls = self.parts @ turning @ axes[:, clear] / np.sqrt(sizes[clear])
        count, turns = pulls.shape
        return float(np.square(pulls).sum() / turns * count / max(count - turns, 1))


def hypotheses(geometry: RigGeometry, turning: Float) -> dict[int | None, Float]:
    """Return what may have turned: (P, 3) how the numbers move, by view; None for either of a pair.

    Args:
        geometry: the calibration.
        turning: (P, 3 (V - 1)) how turns of the views about their own axes move the numbers.
    """
    others = [view for view in range(len(geometry.names)) if view != geometry.reference]
    if len(others) == 1:
        return {None: turning}
    found: dict[int | None, Float] = {
        view: turning[:, 3 * place : 3 * place + 3] for place, view in enumerate(others)
    }
    together = np.concatenate([geometry.cam_from_reference[view].rotation for view in others])
    found[geometry.reference] = turning @ together
    return found


def chances(
    evidence: Evidence,
    unknown: Float,
    turnings: Mapping[int | None, Float],
    told_rad: float,
    reference: int,
) -> dict[int | None, float]:
    """Return the probability of such rows by chance against each hypothesis.

    The reference's own errors are in all views, so parts of the picture pull more towards its turn
    than towards those of single views. So many times larger is the noise of its hypothesis; and it
    has the freedoms of one picture.

    Args:
        evidence: of one scene.
        unknown: (P, P) covariance of the calibration.
        turnings: by hypothesis.
        told_rad: 1 sigma from which a turn is not told.
        reference: its view.
    """
    own = {whose: evidence.noise_of(turning, told_rad) for whose, turning in turnings.items()}
    single = float(np.mean([noise for whose, noise in own.items() if whose != reference]))
    found: dict[int | None, float] = {}
    for whose, turning in turnings.items():
        noise, spare = max(evidence.noise, own[whose]), evidence.spare
        if whose == reference:
            noise = evidence.noise * max(1.0, own[whose] / single)
            spare = min(spare, max(len(evidence.parts) - turning.shape[1], 1))
        told, toward = evidence.against(unknown, turning, noise)
        found[whose] = chance(told, toward, spare, told_rad)[0]
    return found


def least_chance(found: Mapping[int | None, float]) -> float:
    """Return the probability of the least of some chances."""
    return min(1.0, len(found) * min(found.values()))


def likeliest(
    evidence: Evidence, unknown: Float, turnings: Mapping[int | None, Float]
) -> int | None:
    """Return the hypothesis that explains most, whatever its chance; see `chances`."""
    explained: dict[int | None, float] = {}
    for whose, turning in turnings.items():
        told, toward = evidence.against(unknown, turning, evidence.noise)
        explained[whose] = float(toward @ np.linalg.pinv(told, hermitian=True) @ toward)
    return max(explained, key=lambda one: explained[one])


def chance(told: Float, toward: Float, spare: int, told_rad: float) -> tuple[float, int]:
    """Probability of such a pull by chance, over the directions that rows tell; and how many."""
    sizes, axes = np.linalg.eigh(told)
    clear = sizes > told_rad**-2.0
    freedoms = int(clear.sum())
    if not freedoms:
        return 1.0, 0
    squares = float(np.sum((axes[:, clear].T @ toward) ** 2 / sizes[clear]))
    return float(fisher.sf(squares / freedoms, freedoms, spare)), freedoms
