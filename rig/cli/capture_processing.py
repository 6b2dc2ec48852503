"""Options of `rig capture` that stand for keys of the profile's section `[processing]`."""

from typing import Annotated

import typer

TemporalFrames = Annotated[
    int | None,
    typer.Option(
        "--temporal",
        metavar="FRAMES",
        min=2,
        max=1000,
        help="Average slopes over so many frames where nothing moves.",
        show_default=False,
    ),
]
RegionOfInterest = Annotated[
    str | None,
    typer.Option(
        "--roi",
        metavar="X,Y,WIDTH,HEIGHT",
        help="Measure this part of the reference view only, px.",
        show_default=False,
    ),
]
FillHoles = Annotated[
    int | None,
    typer.Option(
        "--fill",
        metavar="PX",
        min=1,
        max=1000,
        help="Bridge holes of up to so many px, label 4.",
        show_default=False,
    ),
]
Decimation = Annotated[
    int | None,
    typer.Option(
        "--decimate",
        metavar="N",
        min=2,
        max=8,
        help="Make one pixel of N x N.",
        show_default=False,
    ),
]


def processing_overrides(
    temporal: int | None, roi: str | None, fill: int | None, decimate: int | None
) -> list[str]:
    """Return what options of processing mean, as overrides of a profile."""
    given = {
        "temporal_frames": temporal,
        "roi_px": None if roi is None else _four_numbers(roi),
        "fill_px": fill,
        "decimation": decimate,
    }
    return [f"processing.{key}={value}" for key, value in given.items() if value is not None]


def _four_numbers(text: str) -> str:
    numbers = text.split(",")
    if len(numbers) != 4 or not all(number.strip().isdecimal() for number in numbers):
        raise typer.BadParameter(f"--roi {text}: give X,Y,WIDTH,HEIGHT in whole px")
    return f"[{', '.join(number.strip() for number in numbers)}]"
