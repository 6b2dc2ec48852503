"""Why a ChArUco board was not found, from what was found instead."""

import numpy as np

from rig.arrays import Float
from rig.errors import TargetError
from rig.targets.candidates import candidates
from rig.targets.charuco.board import CharucoBoard, dictionary_bits
from rig.targets.charuco.cells import SampledCells, sample_cells
from rig.targets.charuco.grid_fit import has_square
from rig.targets.charuco.markers import known_markers, place_on_board
from rig.targets.checkerboard_diagnosis import exposure_at_fault, is_board_like
from rig.targets.lattice import RING_PX, Lattice, plain_lattices
from rig.targets.pyramid import Image, Picture
from rig.targets.saddles import bilinear

_MIN_BIT_PX = 1.2
"""Smaller bits cannot be told apart."""
_ENOUGH = (slice(5), slice(5))
"""Rows and columns of a lattice that are searched for other markers: it bounds the work."""
_FEWEST_MARKERS = 2
"""One marker may look like another by chance."""
_MOST_BLUR_BITS = 0.5
"""Sigma of the edges over the side of a bit, above which markers cannot be read."""
_BLUR_REACH = 0.35
"""Half the length of the profiles that show the blur, in sides of a square."""
_BLUR_SAMPLES = 25
_LARGEST = (
    "4X4_1000",
    "5X5_1000",
    "6X6_1000",
    "7X7_1000",
    "ARUCO_ORIGINAL",
    "ARUCO_MIP_36H12",
    "APRILTAG_16H5",
    "APRILTAG_25H9",
    "APRILTAG_36H10",
    "APRILTAG_36H11",
)
"""Dictionaries that hold all others: the smaller ones are the beginning of these."""
_BITS_ACROSS = (6, 7, 8, 9)
"""Bits across a marker of any of them, border included."""


def why_not(
    image: Image, pictures: list[Picture], board: CharucoBoard, seen: list[Lattice], named: int
) -> TargetError:
    """Return the error that says what was asked, what was found and what to do.

    Args:
        image: (H, W) grey, as it was given.
        pictures: the same with black markers on white, if the board is as it was asked for, and its
            halvings.
        board: what was asked for.
        seen: lattices found at any resolution, in px of the picture.
        named: most corners that markers gave a name to.
    """
    asked = f"ChArUco board of {board} squares with {board.dictionary} asked for"
    if named:
        return TargetError(
            f"{asked}, found {named} of its corners, 6 are needed",
            advice="bring more of it into view, nearer, and out of glare",
            reason="few-corners",
        )
    exposure = exposure_at_fault(image, asked)
    if exposure is not None and exposure.reason == "under-exposed":
        return exposure  # What is read in noise is chance.
    picture = pictures[0]
    largest = sorted(seen, key=lambda lattice: -int(lattice.found.sum()))[:2]
    for lattice in (whole.part(_ENOUGH) for whole in largest):
        if not has_square(lattice.found):
            continue
        cells = {
            bits: sample_cells(picture, lattice.xy_px, bits_across=bits, share=board.marker_share)
            for bits in {board.bits_across, *_BITS_ACROSS}
        }
        other = _other_pattern(cells[board.bits_across], board, asked) or _other_layout(
            cells, board, asked
        )
        if other is not None:
            return other
    if exposure is not None:
        return exposure
    best = (
        largest[0]
        if largest and is_board_like(picture, largest[0], with_markers=True)
        else _plain(pictures)
    )
    if best is None:
        return TargetError(
            f"{asked}, nothing like a checkerboard found",
            advice="put the board in view and light it",
            reason="not-found",
        )
    return _unread(picture, best, board, asked)


def _plain(pictures: list[Picture]) -> Lattice | None:
    """The largest lattice of squares whose markers are too small or too blurred to disturb it."""
    lattices = [lattice for _, lattice in candidates(pictures, RING_PX, plain_lattices)]
    planes = [one for one in lattices if is_board_like(pictures[0], one, with_markers=True)]
    return max(planes, key=lambda lattice: int(lattice.found.sum()), default=None)


def _unread(picture: Picture, lattice: Lattice, board: CharucoBoard, asked: str) -> TargetError:
    bit_px = lattice.side_px * board.marker_share / board.bits_across
    corners = f"found {int(lattice.found.sum())} corners on squares of {lattice.side_px:.1f} px"
    if bit_px < _MIN_BIT_PX:
        return TargetError(
            f"{asked}, {corners} but bits of its markers are {bit_px:.1f} px, at least "
            f"{_MIN_BIT_PX} px are needed",
            advice="bring the board nearer or use larger squares",
            reason="too-small",
        )
    blur_px = _blur_px(picture, lattice)
    if blur_px > _MOST_BLUR_BITS * bit_px:
        return TargetError(
            f"{asked}, {corners} but edges blurred by {blur_px:.1f} px on bits of {bit_px:.1f} px: "
            "its markers cannot be read",
            advice="focus the lens, or hold the board still",
            reason="blurred",
        )
    return TargetError(
        f"{asked}, {corners} but no marker of that board among them",
        advice='check the dictionary, or set kind = "checkerboard" if the board has no markers',
        reason="not-found",
    )


def _blur_px(picture: Picture, lattice: Lattice) -> float:
    """Width of the edges, measured across the middle of every side of a square.

    A blurred step of height h has its steepest slope h / (sqrt(2 pi) sigma) in the middle.
    """
    widths: list[Float] = []
    for axis in (0, 1):
        first = np.moveaxis(lattice.xy_px, axis, 0)[:-1].reshape(-1, 2)
        last = np.moveaxis(lattice.xy_px, axis, 0)[1:].reshape(-1, 2)
        along = (last - first)[np.isfinite(last - first).all(axis=1)]
        middle = ((first + last) / 2)[np.isfinite(last - first).all(axis=1)]
        side_px = np.linalg.norm(along, axis=1, keepdims=True)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) / side_px
        reach_px = _BLUR_REACH * side_px[:, 0]
        place = np.linspace(-1, 1, _BLUR_SAMPLES) * reach_px[:, None]
        xy_px = middle[:, None] + place[..., None] * across[:, None]
        grey = bilinear(picture, np.clip(xy_px, 0, np.array(picture.shape[::-1]) - 1))
        step_px = 2 * reach_px / (_BLUR_SAMPLES - 1)
        steepest = np.abs(np.diff(grey, axis=1)).max(axis=1) / step_px
        height = np.ptp(grey, axis=1)
        widths.append(height / np.maximum(steepest, 1e-9) / np.sqrt(2 * np.pi))
    return float(np.median(np.concatenate(widths)))


def _other_pattern(cells: SampledCells, board: CharucoBoard, asked: str) -> TargetError | None:
    """The same layout with its other arrangement, its grey levels turned round, or both."""
    other = board.with_changes(legacy_pattern=not board.legacy_pattern)
    legacy = f"legacy_pattern = {str(other.legacy_pattern).lower()}"
    inverted = f"inverted = {str(not board.inverted).lower()}"
    tried = [(True, board, inverted)]
    if other.first_is_white != board.first_is_white:
        tried += [(False, other, legacy), (True, other, f"{inverted}, {legacy}")]
    for turned_round, changed, settings in tried:
        read = cells.read(inverted=turned_round)
        placing = place_on_board(read, changed.marker_numbers, changed.marker_bits)
        if placing is not None and placing.agreeing >= _FEWEST_MARKERS:
            return TargetError(
                f"{asked}, found {placing.agreeing} of its markers on a board of the other pattern",
                advice=f"set {settings}",
                reason="wrong-pattern",
            )
    return None


def _other_layout(
    cells: dict[int, SampledCells], board: CharucoBoard, asked: str
) -> TargetError | None:
    """Markers of another dictionary, or of this one on a board of other size."""
    read = {
        bits: [sampled.read(inverted=inverted) for inverted in (False, True)]
        for bits, sampled in cells.items()
    }
    own = next(name for name in _LARGEST if _holds(name, board.dictionary))
    most, whose = dict[tuple[int, int], int](), own
    for name in (own, *(other for other in _LARGEST if other != own)):
        bits = dictionary_bits(name)
        for either in read[bits.shape[1] + 2]:
            found = known_markers(either, bits)
            # Markers of fewer bits are read by chance in those of more.
            if len(found) > len(most):
                most, whose = found, name
    if len(most) < _FEWEST_MARKERS:
        return None
    return _named_otherwise(most, whose, own, board, asked)


def _named_otherwise(
    found: dict[tuple[int, int], int],
    name: str,
    own: str,
    board: CharucoBoard,
    asked: str,
) -> TargetError:
    if name != own:
        return TargetError(
            f"{asked}, found {len(found)} markers of {name}",
            advice="set dictionary to it or to a smaller one of the same kind",
            reason="wrong-dictionary",
        )
    across = _across(found)
    if across in (None, board.squares_across) and max(found.values()) < board.marker_count:
        return TargetError(
            f"{asked}, found {len(found)} of its markers but no corners that agree with them",
            advice="bring more of it into view, out of glare, and hold it still",
            reason="few-corners",
        )
    numbers = ", ".join(str(number) for number in sorted(found.values())[:6])
    where = " of other size" if across is None else f" {across} squares across"
    return TargetError(
        f"{asked}, found its markers ({numbers}, ...) as on a board{where}",
        advice="set squares_across and squares_down to what the board has, or use the other board",
        reason="wrong-count",
    )


def _holds(name: str, dictionary: str) -> bool:
    """Whether the second dictionary is the beginning of the first."""
    large, small = dictionary_bits(name), dictionary_bits(dictionary)
    return large.shape[1:] == small.shape[1:] and np.array_equal(large[: len(small)], small)


def _across(found: dict[tuple[int, int], int]) -> int | None:
    """Two rows on in a column, the number has grown by the squares across."""
    grown = [
        found[row + 2, column] - number
        for (row, column), number in found.items()
        if (row + 2, column) in found
    ]
    return int(np.median(grown)) if grown else None
