"""A still life: slanted, curved, thin and overlapping things on a desk, 0.45 to 1.2 m away."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig_sim.scenes.light import Thing
from rig_sim.scenes.materials import (
    glaze,
    lacquer,
    leaf,
    map_sheet,
    photograph,
    plain,
    print_page,
    wallpaper,
    wood,
)
from rig_sim.scenes.place import ball, box, ellipse, rectangle, tube
from rig_sim.surface import Shape

Array = NDArray[np.float64]

DESK_MM = 150.0
"""Height of the optical axis above the desk."""


def desk_things() -> list[Thing]:
    """Return everything on the desk, and the wall behind it."""
    return [
        *_room(),
        *_books(),
        *_globe(),
        *_mug(),
        *_pencils(),
        *_plant(),
        *_parcel(),
        *_wires(),
    ]


def _room() -> list[Thing]:
    along_wall = _turned((1.0, 0.0, 0.0), -5.0)
    poster_mm = np.array([250.0, -190.0, 1100.0])
    return [
        Thing(
            rectangle((0.0, DESK_MM, 800.0), (1000.0, 0.0, 0.0), (0.0, 0.0, -550.0)),
            wood((1300, 2000), 21, boards=7),
        ),
        Thing(
            rectangle((0.0, -250.0, 1110.0), 900.0 * along_wall, (0.0, 450.0, 0.0)),
            wallpaper((900, 1800), 31, period=60),
        ),
        Thing(
            rectangle(poster_mm, 150.0 * along_wall, (8.0, 105.0, 0.0)),
            photograph((420, 600), 41),
        ),
    ]


def _books() -> list[Thing]:
    lower = box((-235.0, DESK_MM, 880.0), (230.0, 62.0, 170.0), yaw_deg=-14.0)
    upper = box((-225.0, DESK_MM - 62.0, 885.0), (190.0, 44.0, 140.0), yaw_deg=9.0)
    covers = [
        Thing(shape, print_page((int(400 * high), 460), 50 + i, line=9, picture=0.0))
        for i, (shape, high) in enumerate(zip(lower, (0.22, 0.3, 0.3, 0.75), strict=True))
    ]
    covers += [
        Thing(shape, wood((int(400 * high), 420), 60 + i, boards=2, level=0.3))
        for i, (shape, high) in enumerate(zip(upper, (0.2, 0.3, 0.3, 0.75), strict=True))
    ]
    right, lean = _turned((1.0, 0.0, 0.0), 24.0), np.array([0.0, 1.0, -0.28])
    magazine = rectangle((-20.0, DESK_MM - 118.0, 960.0), 92.0 * right, 118.0 * lean)
    card = rectangle(
        (150.0, DESK_MM - 40.0, 700.0), 30.0 * _turned((1.0, 0.0, 0.0), -38.0), 41.0 * lean
    )
    return [
        *covers,
        Thing(magazine, print_page((560, 420), 70, line=10)),
        Thing(card, print_page((220, 160), 73, line=8)),
    ]


def _globe() -> list[Thing]:
    centre = np.array([215.0, 40.0, 850.0])
    foot = np.array([215.0, DESK_MM, 850.0])
    return [
        Thing(ball(centre, 82.0, tilt_deg=23.0), map_sheet((520, 1040), 80)),
        Thing(tube(foot, centre, 9.0), lacquer((120, 60), 83, level=0.4, stripes=3)),
        Thing(tube(foot, foot - (0.0, 9.0, 0.0), 48.0), plain((20, 500), 84, level=0.35)),
        Thing(
            ellipse(foot - (0.0, 9.0, 0.0), (48.0, 0.0, 0.0), (0.0, 0.0, -48.0)),
            plain((500, 90), 85, level=0.4),
        ),
    ]


def _mug() -> list[Thing]:
    foot = np.array([28.0, DESK_MM, 600.0])
    rim = foot - (0.0, 92.0, 0.0)
    return [
        Thing(tube(foot, rim, 39.0), glaze((260, 680), 90)),
        Thing(
            ellipse(rim, (39.0, 0.0, 0.0), (0.0, 0.0, -39.0)),
            plain((600, 100), 93, level=0.3, grain=0.05),
        ),
    ]


def _pencils() -> list[Thing]:
    foot = np.array([-128.0, DESK_MM, 690.0])
    rim = foot - (0.0, 80.0, 0.0)
    parts = [
        Thing(tube(foot, rim, 33.0), wood((200, 520), 100, boards=9, level=0.5)),
        Thing(
            ellipse(rim, (33.0, 0.0, 0.0), (0.0, 0.0, -33.0)),
            plain((500, 80), 103, level=0.3, grain=0.06),
        ),
    ]
    tips = (
        (-62.0, -150.0, 20.0),
        (-18.0, -172.0, -14.0),
        (22.0, -160.0, 26.0),
        (64.0, -138.0, -8.0),
    )
    for number, tip in enumerate(tips):
        root = rim + np.array(tip) * (0.25, 0.0, 0.25)
        paint = lacquer((320, 48), 110 + 2 * number, level=0.3 + 0.1 * number, stripes=6)
        parts.append(Thing(tube(root, rim + tip, 3.6), paint))
    lying = (((-60.0, 520.0), (95.0, 555.0)), ((150.0, 545.0), (205.0, 640.0)))
    for number, ((x0, z0), (x1, z1)) in enumerate(lying):
        height = DESK_MM - 4.0
        start, end = np.array([x0, height, z0]), np.array([x1, height, z1])
        paint = lacquer((360, 60), 120 + 2 * number, level=0.55 - 0.15 * number, stripes=6)
        parts += [
            Thing(tube(start, end, 4.0), paint),
            Thing(_cap(start, end - start, 4.0), plain((40, 20), 124 + number, level=0.5)),
        ]
    return parts


def _plant() -> list[Thing]:
    foot = np.array([395.0, DESK_MM, 930.0])
    rim = foot - (0.0, 85.0, 0.0)
    parts = [
        Thing(tube(foot, rim, 55.0), glaze((200, 600), 130)),
        Thing(
            ellipse(rim, (55.0, 0.0, 0.0), (0.0, 0.0, -55.0)),
            plain((600, 100), 133, level=0.25, grain=0.07),
        ),
    ]
    random = np.random.default_rng(140)
    for number in range(13):
        turn = 2.0 * np.pi * number / 13.0 + random.uniform(-0.2, 0.2)
        reach, rise = random.uniform(45.0, 110.0), random.uniform(70.0, 210.0)
        middle = rim + np.array([reach * np.cos(turn), -rise, 0.7 * reach * np.sin(turn)])
        along = np.array([np.cos(turn), random.uniform(-0.6, 0.5), 0.5 * np.sin(turn)])
        along /= np.linalg.norm(along)
        parts.append(Thing(_facing_leaf(middle, along, random), leaf((300, 120), 150 + number)))
        parts.append(
            Thing(
                tube(rim, middle - 30.0 * along, 2.2),
                lacquer((200, 24), 170 + number, level=0.35, stripes=2),
            )
        )
    return parts


def _parcel() -> list[Thing]:
    sides = box((-310.0, DESK_MM, 630.0), (120.0, 66.0, 90.0), yaw_deg=-28.0)
    label = print_page((190, 300), 190, line=8, picture=0.0)
    return [
        Thing(shape, plain((160, 260), 191 + i, level=0.5, grain=0.05))
        if i != 0
        else Thing(shape, label)
        for i, shape in enumerate(sides)
    ]


def _wires() -> list[Thing]:
    """A pole through the whole picture and a cable hanging from it."""
    pole = tube((118.0, DESK_MM, 780.0), (112.0, -420.0, 780.0), 5.0)
    parts = [Thing(pole, lacquer((900, 60), 200, level=0.55, stripes=1))]
    run = np.linspace(0.0, 1.0, 15)
    cable = np.stack(
        [115.0 - 480.0 * run, -150.0 + 190.0 * run - 560.0 * run * (1.0 - run), 780.0 - 90.0 * run],
        axis=-1,
    )
    for number, (start, end) in enumerate(pairwise(cable)):
        parts.append(
            Thing(tube(start, end, 2.6), lacquer((80, 30), 210 + number, level=0.25, stripes=2))
        )
    return parts


def _cap(centre: Array, inwards: Array, radius_mm: float) -> Shape:
    """The sawn-off end of something level."""
    aside = np.cross(inwards, (0.0, -1.0, 0.0))
    right = aside / np.linalg.norm(aside) * radius_mm
    return ellipse(centre, right, (0.0, radius_mm, 0.0))


def _facing_leaf(middle: Array, along: Array, random: np.random.Generator) -> Shape:
    """A leaf that shows its upper side, more or less."""
    towards_viewer = -middle / np.linalg.norm(middle)
    aside = np.cross(along, towards_viewer + random.uniform(-0.6, 0.6, 3))
    aside *= random.uniform(15.0, 22.0) / np.linalg.norm(aside)
    length = along * random.uniform(36.0, 52.0)
    if np.cross(length, aside) @ middle < 0.0:
        aside = -aside
    return ellipse(middle, length, aside)


def _turned(vector: tuple[float, float, float], yaw_deg: float) -> Array:
    """Turn a vector about the vertical; positive turns the right towards the viewer."""
    cos, sin = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    x, y, z = vector
    return np.array([cos * x + sin * z, y, -sin * x + cos * z])
