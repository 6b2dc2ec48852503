"""Drawn rigs without a fault, and the same with one, to ask the verdict of a calibration about.

Rigs of three 1280 x 800 cameras, 75 mm H-V, with corners rendered and fitted as those of real
pictures, over blurs and noises from almost none to much. Faults have twice the size that costs
0.1 % of the depth at 1 m where their size is a length or a scatter: `CASES` tells each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from benchmarks.calibration_corners import Picture, rendered_sightings
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import HEIGHT, WIDTH, Scene, on_stage, random_scene

FAULT_MM = 0.15
"""Twice 0.1 % of the baseline: what it costs in depth, at any distance."""
FAULT_PX = 0.13
"""Twice 0.1 % of the disparity at 1 m: what the corners of a blurred picture scatter by."""
FAULT_SHARE = 0.002
"""Of the focal length, by which it breathes from picture to picture: of depth as much."""
STRAY_PX, STRAY_SHARE = 1.5, 0.04
"""Corners that are found beside where they are, and how many of them."""
TRUE_SQUARE_MM = {"square 1 % small, on a stage": 24.75, "square 0.2 % small, on a stage": 24.95}
"""Where 25 mm are told."""
STOPS_MM = np.linspace(0.0, 350.0, 8)


@dataclass
class Rig:
    """One draw."""

    scene: Scene
    like: Picture
    seed: int
    stage_mm: dict[int, float] = field(default_factory=dict[int, float])
    """Driver position by picture."""

    @property
    def count(self) -> int:
        """Number of pictures."""
        return len(self.scene.poses)

    @property
    def half(self) -> int:
        """Index of the middle picture."""
        return self.count // 2

    def but(self, other: Scene, view: int, pictures: Sequence[int]) -> list[Sighting]:
        """The same, but for one view in some pictures, which show another scene."""
        wrong = rendered_sightings(other, 3000 + self.seed, self.like, pictures, [view])
        right = [s for s in self.right if s.view != view or s.picture not in pictures]
        return right + wrong

    @cached_property
    def right(self) -> list[Sighting]:
        """Every corner that is found where nothing is wrong."""
        return rendered_sightings(self.scene, 1000 + self.seed, self.like)


class Case(NamedTuple):
    """What is done to a rig, and how that is told."""

    make: Callable[[Rig], list[Sighting]]
    wanted: tuple[str, ...] = ()
    """Codes of which one must be told; none where nothing is wrong."""
    staged: bool = False


def draw(seed: int) -> Rig:
    """A rig, 12 to 24 pictures, blur 0.35 to 1.3 px, noise 0.1 to 4 levels (even in logarithm)."""
    rng = np.random.default_rng(7000 + seed)
    scene = random_scene(seed, int(rng.integers(12, 25)))
    if rng.uniform() < 0.5:
        scene = replace(scene, bend_mm=(0.0, 0.0, 0.0))
    blur_px, noise = np.exp(rng.uniform(np.log([0.35, 0.1]), np.log([1.3, 4.0])))
    return Rig(scene, Picture(float(blur_px), float(noise)), seed)


def staged(rig: Rig, square_mm: float | None = None) -> Rig:
    """The same with a stage that carries the board away, and perhaps another board."""
    rng = np.random.default_rng(9000 + rig.seed)
    axis = np.array([*rng.uniform(-0.02, 0.02, 2), 1.0])
    scene = on_stage(rig.scene, axis / np.linalg.norm(axis), STOPS_MM, 450.0)
    if square_mm is not None:
        scene = replace(scene, square_mm=square_mm)
    stage_mm = {rig.count + n: float(at_mm) for n, at_mm in enumerate(STOPS_MM)}
    return Rig(scene, rig.like, rig.seed, stage_mm)


def faultless(rig: Rig) -> list[Sighting]:
    """Nothing is wrong."""
    return rig.right


def bumped(rig: Rig) -> list[Sighting]:
    """One camera stands aside, along its baseline, from half-way on."""
    cameras = list(rig.scene.cameras)
    aside = np.add(cameras[1].centre_mm, (FAULT_MM, 0.0, 0.0))
    cameras[1] = replace(cameras[1], centre_mm=tuple(aside))
    return rig.but(replace(rig.scene, cameras=tuple(cameras)), 1, range(rig.half, rig.count))


def late(rig: Rig) -> list[Sighting]:
    """One view shows the board aside, elsewhere in every picture."""
    return rig.but(_aside(rig, range(rig.count)), 1, range(rig.count))


def moved(rig: Rig) -> list[Sighting]:
    """One view shows the board aside in one picture."""
    return rig.but(_aside(rig, [rig.half]), 1, [rig.half])


def blurred(rig: Rig) -> list[Sighting]:
    """The corners of all views scatter in two pictures."""
    rng = np.random.default_rng(rig.seed)
    bad = (rig.half, rig.half + 1)
    return [
        replace(s, xy_px=s.xy_px + rng.normal(0.0, FAULT_PX, s.xy_px.shape))
        if s.picture in bad
        else s
        for s in rig.right
    ]


def exchanged(rig: Rig) -> list[Sighting]:
    """Two views carry each other's name."""
    return [replace(s, view=(0, 2, 1)[s.view]) for s in rig.right]


def exchanged_once(rig: Rig) -> list[Sighting]:
    """The same in one picture, which all views show."""
    shown = [{s.view for s in rig.right if s.picture == n} for n in range(rig.count)]
    bad = max(range(rig.count), key=lambda n: (len(shown[n]), -abs(n - rig.half)))
    return [replace(s, view=(0, 2, 1)[s.view]) if s.picture == bad else s for s in rig.right]


def upside_down(rig: Rig) -> list[Sighting]:
    """The reference camera stands on its head."""
    last = np.array([WIDTH - 1, HEIGHT - 1])
    return [replace(s, xy_px=last - s.xy_px) if s.view == 0 else s for s in rig.right]


def strays(rig: Rig) -> list[Sighting]:
    """Some corners are found beside where they are."""
    rng = np.random.default_rng(rig.seed)
    return [_with_strays(s, rng) for s in rig.right]


def breathing(rig: Rig) -> list[Sighting]:
    """Focal lengths differ from picture to picture, in all views alike."""
    rng = np.random.default_rng(rig.seed)
    grow = 1.0 + rng.uniform(-FAULT_SHARE, FAULT_SHARE, rig.count)
    middles = [np.asarray(camera.middle_px) for camera in rig.scene.cameras]
    return [
        replace(s, xy_px=middles[s.view] + (s.xy_px - middles[s.view]) * grow[s.picture])
        for s in rig.right
    ]


def again(rig: Rig) -> list[Sighting]:
    """The last three pictures are the first one."""
    first = [s for s in rig.right if s.picture == 0]
    new = range(rig.count - 3, rig.count)
    kept = [s for s in rig.right if s.picture not in new]
    return kept + [replace(s, picture=picture) for picture in new for s in first]


def _with_strays(right: Sighting, rng: np.random.Generator) -> Sighting:
    wrong = rng.uniform(size=len(right)) < STRAY_SHARE
    angle_rad = rng.uniform(0, 2 * np.pi, len(right))
    away = STRAY_PX * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    return replace(right, xy_px=right.xy_px + np.where(wrong[:, None], away, 0.0))


def _aside(rig: Rig, pictures: Sequence[int]) -> Scene:
    rng = np.random.default_rng(rig.seed)
    poses = list(rig.scene.poses)
    for picture in pictures:
        angle_rad = rng.uniform(0, 2 * np.pi)
        aside = FAULT_MM * np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])
        middle_mm = tuple(np.add(poses[picture].middle_mm, aside))
        poses[picture] = replace(poses[picture], middle_mm=middle_mm)
    return replace(rig.scene, poses=tuple(poses))


CASES: dict[str, Case] = {
    "faultless": Case(faultless),
    "faultless, on a stage": Case(faultless, staged=True),
    "bumped": Case(bumped, ("bumped",)),
    "late in every picture": Case(late, ("unsynchronised", "moved")),
    "moved in one picture": Case(moved, ("moved",)),
    "blurred in two pictures": Case(blurred, ("blurred",)),
    "two views exchanged": Case(exchanged, ("swapped",)),
    "exchanged in one picture": Case(exchanged_once, ("swapped",)),
    "reference upside down": Case(upside_down, ("turned",)),
    "4 % of the corners astray": Case(strays, ("outliers",)),
    "focus breathes": Case(breathing, ("model",)),
    "first picture thrice again": Case(again, ("repeated",)),
} | {name: Case(faultless, ("square-size",), staged=True) for name in TRUE_SQUARE_MM}
