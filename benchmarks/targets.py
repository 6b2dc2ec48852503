"""Corners of checkerboards and ChArUco boards: error, sigma, time, also without a board in view.

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
from rig.targets import CharucoBoard, Detection, find_target
from rig.targets.checkerboard import Checkerboard
from tests.support.board_images import BoardScene, digitised
from tests.support.charuco_images import CharucoScene

Image = NDArray[np.uint8]

CHARUCO = CharucoBoard(11, 8, 30.0, 22.5, "4X4_50")
CHECKER = Checkerboard(9, 6, 30.0)
SIZE = (1280, 800)
MARGINS = ((0.9, 28.0), (0.75, 18.0), (0.9, 45.0), (0.75, 28.0), (0.75, 45.0), (0.6, 45.0))
"""Side of a marker in squares, and of a square in px."""
TILTS_DEG = (
    (10.0, -20.0, 30.0),
    (-25.0, 15.0, -60.0),
    (20.0, 25.0, 100.0),
    (0.0, 30.0, 10.0),
    (-10.0, -10.0, 200.0),
)


def scene_of(target: Checkerboard | CharucoBoard, random: np.random.Generator) -> BoardScene:
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


def tried(image: Image, target: Checkerboard | CharucoBoard) -> Detection | str:
    """The corners, or the reason."""
    try:
        return find_target(image, target)
    except TargetError as error:
        return error.reason


def measure(target: Checkerboard | CharucoBoard, pictures: int) -> None:
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


def measure_margins() -> None:
    """Print how honest sigma is where markers come close to the corners."""
    print("margin, px  blur, px  noise: error px rms, robust std of error / sigma, corners found")
    for share, side_px in MARGINS:
        board = CharucoBoard(7, 5, 25.0, 25.0 * share, "4X4_50")
        for blur_px in (0.6, 1.0, 1.5):
            for noise in (1.0, 5.0):
                error, ratio, shown = _at_margin(board, side_px, blur_px, noise)
                row = f"{(1 - share) / 2 * side_px:10.2f} {blur_px:9.1f} {noise:6.0f}: "
                if len(error) < shown:
                    print(row + f"{len(error) // 2} of {shown // 2} corners: markers unreadable")
                    continue
                robust = 1.4826 * np.median(np.abs(ratio))
                print(row + f"{np.sqrt(np.mean(error**2)):.4f}, {robust:.2f}, all")


def _at_margin(
    board: CharucoBoard, side_px: float, blur_px: float, noise: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    errors: list[NDArray[np.float64]] = [np.empty(0)]
    ratios: list[NDArray[np.float64]] = [np.empty(0)]
    for index, tilt_deg in enumerate(TILTS_DEG):
        scene = CharucoScene(
            width=400,
            height=340,
            distance_mm=560.0 * board.square_mm / side_px,
            tilt_deg=tilt_deg,
            offset_mm=(0.3 * index, 0.2 * index),
            blur_px=blur_px,
            marker_share=board.marker_share,
        )
        clean, truth = scene.clean(), scene.corners().reshape(-1, 2)
        for seed in range(2):
            image = digitised(clean, noise=noise, rng=np.random.default_rng(seed))
            found = tried(image, board)
            if not isinstance(found, str):
                error = found.xy_px - truth[found.ids]
                errors.append(error.ravel())
                ratios.append((error / found.sigma_px[:, None]).ravel())
    shown = 2 * 2 * len(TILTS_DEG) * board.rows * board.columns
    return np.concatenate(errors), np.concatenate(ratios), shown


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=30)
    pictures = int(parser.parse_args().pictures)
    cv2.setNumThreads(1)
    print(f"{SIZE[0]} x {SIZE[1]}, blur 0.7 px, noise 2 grey levels")
    for target in (CHECKER, CHARUCO):
        measure(target, pictures)
    measure_margins()
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
