"""The lens of OpenCV's list of distortion coefficients, which many tools write as it is."""

from collections.abc import Sequence

from rig.errors import FormatError
from rig.geometry.lens import LensModel

_COUNTS = (0, 4, 5, 8, 12, 14)
"""Lengths that OpenCV knows: up to p2, k3, k6, thin prism, tilted sensor."""
NO_PRISM = (
    "calibrate again without thin prism and tilt (at most eight coefficients), with that tool or "
    "with `rig calibrate`"
)


def opencv_lens(flat: Sequence[float], where: str) -> tuple[LensModel, list[float]]:
    """Return the Brown-Conrady lens of a list, `brown5` where its rational terms are zero.

    Args:
        flat: k1, k2, p1, p2, k3, k4, k5, k6, then thin prism and tilt; shorter lists end in zeros.
        where: file and place, for errors.

    Raises:
        FormatError: OpenCV knows no list of this length, or the lens has a prism or a tilt.
    """
    if len(flat) not in _COUNTS:
        raise FormatError(
            f"{where}: has {len(flat)} distortion coefficients, OpenCV's lenses have "
            f"{', '.join(map(str, _COUNTS))}",
            advice="give the coefficients as OpenCV wrote them",
        )
    if any(flat[8:]):
        raise FormatError(
            f"{where}: has a thin-prism or tilted lens, which is not known here", advice=NO_PRISM
        )
    wanted = [*flat[:8], *[0.0] * (8 - len(flat))]
    return ("brown8", wanted) if any(wanted[5:]) else ("brown5", wanted[:5])


def fisheye_lens(flat: Sequence[float], where: str) -> tuple[LensModel, list[float]]:
    """Return the lens of OpenCV's fisheye model, four coefficients of odd powers of the angle.

    Raises:
        FormatError: it has another number of coefficients, of which more than four are not zero.
    """
    if len(flat) < 4 or any(flat[4:]):
        raise FormatError(
            f"{where}: has {len(flat)} coefficients of a fisheye, expected 4",
            advice="give the coefficients as OpenCV's fisheye calibration wrote them",
        )
    return "fisheye", list(flat[:4])
