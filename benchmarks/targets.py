"""Corners of checkerboards and ChArUco boards: error, time, and time on pictures without a board.

Beside OpenCV's marker detector on the same pictures. Process time, one thread, median.

Run: python -m benchmarks.targets [--pictures 30]
"""

import argparse
import time
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.errors import TargetError
from rig.geometry.board import Board
from rig.geometry.targets import CharucoBoard, Detection, Target, find_target
from tests.support.board_images import BoardScene, digitised
from tests.support.charuco_images import CharucoScene

Image = NDArray[np.uint8]

CHARUCO = CharucoBoard(11, 8, 30.0, 22.5, "4X4_50")
CHECKER = Board(9, 6, 30.0)
SIZE = (1280, 800)


def scene_of(target: Target, random: np.random.Generator) -> BoardScene:
    """A pose that a hand-held board may have; parts of it may be out of view."""
    kind = CharucoScene if isinstance(target, CharucoBoard) else BoardScene
    reach = 80.0 if isinstance(target, CharucoBoard) else 20.0
    return kind(
        columns=target.columns,
        rows=target.rows,
        square_mm=target.square_mm,
        width=SIZE[0],
        height=SIZE[1],
        focal_px=882.0,
        blur_px=0.7,
        distance_mm=float(random.uniform(400, 1000)),
        offset_mm=(float(random.uniform(-reach, reach)), float(random.uniform(-reach, reach))),
        tilt_deg=(
            float(random.uniform(-35, 35)),
            float(random.uniform(-35, 35)),
            float(random.uniform(-25, 25)),
        ),
        background_contrast=30.0,
    )


def without_board(random: np.random.Generator) -> dict[str, Image]:
    """Pictures that give a detector work."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    smooth = cv2.GaussianBlur(random.standard_normal(SIZE[::-1]), (0, 0), 3.0)
    return {
        "black": np.zeros(SIZE[::-1], np.uint8),
        "noise": random.integers(0, 255, SIZE[::-1]).astype(np.uint8),
        "clouds": np.clip(110 + 400 * smooth, 0, 255).astype(np.uint8),
        "small chess": ((x // 10 + y // 10) % 2 * 200).astype(np.uint8),
        "large chess": ((x // 16 + y // 16) % 2 * 200).astype(np.uint8),
        "small squares": (((x % 16 < 10) & (y % 16 < 10)) * 200).astype(np.uint8),
    }


def timed(work: Callable[[], object]) -> float:
    """Process time of a call, s."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def tried(image: Image, target: Target) -> Detection | str:
    """The corners, or the reason."""
    try:
        return find_target(image, target)
    except TargetError as error:
        return error.reason


def measure(target: Target, pictures: int) -> None:
    """Print error and time of one kind of board."""
    random = np.random.default_rng(5)
    errors: list[NDArray[np.float64]] = []
    times_s: list[float] = []
    missed = visible = 0
    for _ in range(pictures):
        scene = scene_of(target, random)
        image = digitised(scene.clean(), noise=2.0, rng=random)
        truth = scene.corners().reshape(-1, 2)
        x, y = truth.T
        inside = (x > 8) & (x < SIZE[0] - 9) & (y > 8) & (y < SIZE[1] - 9)
        if not isinstance(target, CharucoBoard) and not inside.all():
            continue
        times_s.append(timed(lambda image=image: tried(image, target)))
        found = tried(image, target)
        visible += int(inside.sum())
        if isinstance(found, str):
            missed += int(inside.sum())
            continue
        missed += int(inside.sum()) - int(inside[found.ids].sum())
        errors.append((found.xy_px - truth[found.ids]).ravel())
    error = np.concatenate(errors)
    print(
        f"{type(target).__name__} {target}: {len(times_s)} pictures, rms "
        f"{np.sqrt(np.mean(error**2)):.4f} px, worst {np.abs(error).max():.3f} px, missed "
        f"{missed} of {visible} corners in view; {np.median(times_s) * 1e3:.0f} ms, at most "
        f"{max(times_s) * 1e3:.0f} ms"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=30)
    pictures = int(parser.parse_args().pictures)
    cv2.setNumThreads(1)
    print(f"{SIZE[0]} x {SIZE[1]}, blur 0.7 px, noise 2 grey levels")
    for target in (CHECKER, CHARUCO):
        measure(target, pictures)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    print(f"{'no board, ms':>14} {'checkerboard':>13} {'ChArUco':>8} {'OpenCV markers':>15}")
    for name, image in without_board(np.random.default_rng(1)).items():
        rows = [
            timed(lambda image=image: tried(image, CHECKER)),
            timed(lambda image=image: tried(image, CHARUCO)),
            timed(lambda image=image: detector.detectMarkers(image)),
        ]
        print(f"{name:>14} {rows[0] * 1e3:13.0f} {rows[1] * 1e3:8.0f} {rows[2] * 1e3:15.0f}")


if __name__ == "__main__":
    main()
