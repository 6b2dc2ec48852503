"""Random damage of motion JPEG pictures: how much of it is noticed, and is a good picture refused?

    python -m benchmarks.mjpg [--damages 10000] [--good 1000] [--seed 1]

Pictures of textured scenes with a checkerboard, in the samplings and qualities that cameras send,
with and without restart markers. A damage overwrites 1 to 200 bytes in a row, anywhere, with random
ones. It counts where it changes more than 0.1 % of the grey pixels of what the decoder makes of it.
It is harmless where not even the colour of one pixel changes.
"""

import argparse
from collections import Counter

import cv2
import numpy as np
from numpy.typing import NDArray
from rig_drivers.jpeg.grey import JpegDamageError, grey_of_jpeg
from rig_drivers.jpeg.whole import require_whole

WIDTH_PX, HEIGHT_PX = 640, 480
KINDS = (
    ("4:2:0 quality 60", 60, 0x221111, 0),
    ("4:2:2 quality 80", 80, 0x211111, 0),
    ("4:2:0 quality 90", 90, 0x221111, 0),
    ("4:2:2 quality 80, a restart per row", 80, 0x211111, WIDTH_PX // 16),
    ("4:4:4 quality 95", 95, 0x111111, 0),
)
COUNTS_FROM = 1e-3
MOST_BYTES = 200
Picture = NDArray[np.uint8]


def scene(seed: int) -> Picture:
    """Return a scene in colour: structure of four sizes, and a board before it."""
    random = np.random.default_rng(seed)
    size = (WIDTH_PX, HEIGHT_PX)
    image = np.full((HEIGHT_PX, WIDTH_PX, 3), 120.0)
    for scale_px, contrast in ((1, 4.0), (4, 18.0), (16, 30.0), (64, 60.0)):
        coarse = random.normal(size=(HEIGHT_PX // scale_px + 2, WIDTH_PX // scale_px + 2, 3))
        image += contrast * cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
    rows, columns = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    board = (rows // 40 + columns // 40) % 2 * 160.0 + 50.0
    inside = (slice(HEIGHT_PX // 4, 3 * HEIGHT_PX // 4), slice(WIDTH_PX // 4, 3 * WIDTH_PX // 4))
    image[inside] = 0.2 * image[inside] + 0.8 * board[inside][..., None]
    return np.clip(image, 0, 255).astype(np.uint8)


def coded(image: Picture, quality: int, sampling: int, restart: int) -> Picture:
    """Return a picture as a camera sends it."""
    options = (
        cv2.IMWRITE_JPEG_QUALITY,
        quality,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
        sampling,
        cv2.IMWRITE_JPEG_RST_INTERVAL,
        restart,
    )
    return np.asarray(cv2.imencode(".jpg", image, options)[1], np.uint8).ravel()


def is_refused(data: Picture) -> bool:
    """Whether the driver would drop it."""
    try:
        grey_of_jpeg(data, width_px=WIDTH_PX, height_px=HEIGHT_PX)
    except JpegDamageError:
        return True
    return False


def is_refused_in_a_file(data: Picture) -> bool:
    """Whether stored pictures of this content are told to be damaged."""
    try:
        require_whole(data.tobytes())
    except JpegDamageError:
        return True
    return False


def decoded(data: Picture, flag: int) -> Picture:
    """Return what the decoder makes of it, concealing what it can; empty where it gives up."""
    image = cv2.imdecode(data, flag)
    return np.zeros((0, 0), np.uint8) if image is None else np.asarray(image, np.uint8)


def damaged(data: Picture, random: np.random.Generator) -> Picture:
    """Return a copy with random bytes somewhere."""
    count = int(random.integers(1, MOST_BYTES + 1))
    at = int(random.integers(0, data.size - count))
    copy = data.copy()
    copy[at : at + count] = random.integers(0, 256, count)
    return copy


def campaign(damages: int, seed: int) -> dict[str, Counter[str]]:
    """Return by kind of picture what came of its damages."""
    random = np.random.default_rng(seed)
    tally = {kind[0]: Counter[str]() for kind in KINDS}
    good = [coded(scene(seed + place), *kind[1:]) for place, kind in enumerate(KINDS)]
    colours = [decoded(data, cv2.IMREAD_COLOR) for data in good]
    greys = [decoded(data, cv2.IMREAD_GRAYSCALE) for data in good]
    for number in range(damages):
        place = number % len(KINDS)
        data = damaged(good[place], random)
        grey = decoded(data, cv2.IMREAD_GRAYSCALE)
        is_read = grey.shape == greys[place].shape
        changed = float(np.mean(grey != greys[place])) if is_read else 1.0
        refused = is_refused(data)
        counts = tally[KINDS[place][0]]
        if changed > COUNTS_FROM:
            counts["counting"] += 1
            counts["noticed"] += refused
            counts["noticed in a file"] += not is_read or is_refused_in_a_file(data)
        elif refused and changed == 0.0:
            colour = decoded(data, cv2.IMREAD_COLOR)
            counts["harmless refused"] += bool(np.array_equal(colour, colours[place]))
    return tally


def good_refused(pictures: int, seed: int) -> int:
    """Return how many undamaged pictures are refused, padded, cut of their end mark or plain."""
    random = np.random.default_rng(seed)
    refused = 0
    for number in range(pictures):
        _, quality, sampling, restart = KINDS[number % len(KINDS)]
        data = coded(scene(1000 + number), quality, sampling, restart)
        tail = random.integers(0, 256, 200).astype(np.uint8)
        ends = (data, np.concatenate([data, tail]), data[:-2], np.append(data[:-2], tail * 0))
        refused += is_refused(ends[number // len(KINDS) % len(ends)])
    return refused


def main() -> None:
    """Print one line per kind of picture, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--damages", type=int, default=10_000)
    parser.add_argument("--good", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    total: Counter[str] = Counter()
    for name, counts in campaign(asked.damages, asked.seed).items():
        total += counts
        share = counts["noticed"] / max(1, counts["counting"])
        print(f"{name:40} {counts['noticed']:6} of {counts['counting']:6} noticed, {share:.2%}")
    share = total["noticed"] / max(1, total["counting"])
    print(f"{'all':40} {total['noticed']:6} of {total['counting']:6} noticed, {share:.2%}")
    share = total["noticed in a file"] / max(1, total["counting"])
    print(f"{'the same as stored pictures':40} {total['noticed in a file']:6} noticed, {share:.2%}")
    print(f"harmless damages refused: {total['harmless refused']}")
    print(f"undamaged refused: {good_refused(asked.good, asked.seed)} of {asked.good}")


if __name__ == "__main__":
    main()
