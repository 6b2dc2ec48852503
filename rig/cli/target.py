"""`rig target`: a board to print."""

from collections.abc import Generator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, Overrides, finite
from rig.cli.output import show, show_json
from rig.cli.words import profile_names

if TYPE_CHECKING:
    from rig.targets import Target


class Kind(StrEnum):
    """What can be drawn."""

    CHECKERBOARD = "checkerboard"
    CHARUCO = "charuco"
    APRILGRID = "aprilgrid"
    CIRCLES = "asymmetric_circles"


def target(
    profile_name: Annotated[
        str | None,
        typer.Argument(
            metavar="PROFILE",
            help="Draw the target of this profile.",
            show_default=False,
            autocompletion=profile_names,
        ),
    ] = None,
    *,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FILE", help="A .pdf, .svg or .png.", show_default=False),
    ],
    kind: Annotated[
        Kind | None, typer.Option("--kind", help="Draw this, without a profile.")
    ] = None,
    described: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Draw what a target file of Kalibr (YAML) describes.",
            show_default=False,
        ),
    ] = None,
    size: Annotated[
        str,
        typer.Option(
            "--size",
            metavar="COLUMNSxROWS",
            help="Inner corners of a checkerboard, squares of a ChArUco board, tags of an "
            "AprilGrid, circles in a row and rows.",
        ),
    ] = "9x6",
    square_mm: Annotated[
        float, typer.Option("--square-mm", min=0.0, callback=finite, help="Side of a square.")
    ] = 25.0,
    marker_mm: Annotated[
        float | None,
        typer.Option(
            "--marker-mm",
            min=0.0,
            callback=finite,
            help="Side of a marker.",
            show_default="3/4 of a square",
        ),
    ] = None,
    tag_mm: Annotated[
        float,
        typer.Option("--tag-mm", min=0.0, callback=finite, help="Side of a tag of an AprilGrid."),
    ] = 30.0,
    spacing: Annotated[
        float,
        typer.Option(
            "--spacing", min=0.0, callback=finite, help="Gap between tags over the side of a tag."
        ),
    ] = 0.3,
    first_tag: Annotated[
        int, typer.Option("--first-tag", min=0, help="Number of the tag at the bottom left.")
    ] = 0,
    spacing_mm: Annotated[
        float,
        typer.Option(
            "--spacing-mm", min=0.0, callback=finite, help="From one row of circles to the next."
        ),
    ] = 18.0,
    diameter_mm: Annotated[
        float | None,
        typer.Option(
            "--diameter-mm",
            min=0.0,
            callback=finite,
            help="Of a circle.",
            show_default="0.8 of --spacing-mm",
        ),
    ] = None,
    dictionary: Annotated[
        str, typer.Option("--dictionary", help="One of OpenCV's dictionaries of markers.")
    ] = "4X4_50",
    inverted: Annotated[bool, typer.Option("--inverted", help="White on black.")] = False,
    legacy: Annotated[
        bool, typer.Option("--legacy", help="The pattern of OpenCV before 4.6.")
    ] = False,
    page: Annotated[
        str, typer.Option("--page", help="a4, a3, a2, letter, tabloid, or WIDTHxHEIGHT in mm.")
    ] = "a4",
    border_mm: Annotated[
        float,
        typer.Option(
            "--border-mm", min=0.0, callback=finite, help="What the printer leaves white."
        ),
    ] = 5.0,
    dots_per_in: Annotated[
        float,
        typer.Option(
            "--dpi", min=10.0, max=10_000.0, callback=finite, help="Resolution of a .png."
        ),
    ] = 300.0,
    overrides: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Draw a target to scale, to be printed at 100 %.

    On it stand its sizes and a ruler of 100 mm: measure that, and a few squares, tags or rows, and
    glue the print onto something flat.
    """
    from rig.targets import AprilGrid, CharucoBoard, CircleGrid
    from rig.targets.checkerboard import Checkerboard
    from rig.targets.printing.board_areas import board_size_mm
    from rig.targets.printing.sheet import draw_sheet, page_mm
    from rig.targets.printing.write import write_sheet

    if sum(given is not None for given in (profile_name, kind, described)) != 1:
        raise typer.BadParameter("give one of PROFILE, --kind and --from")
    if described is not None:
        board = _of_file(described, diameter_mm)
    elif profile_name is not None:
        board = _of_profile(profile_name, overrides or [])
    else:
        with _from_options():
            columns, rows = _counts(size)
            match kind:
                case Kind.APRILGRID:
                    board = AprilGrid(columns, rows, tag_mm, spacing, first_tag=first_tag)
                case Kind.CIRCLES:
                    wide_mm = 0.8 * spacing_mm if diameter_mm is None else diameter_mm
                    board = CircleGrid(columns, rows, spacing_mm, wide_mm)
                case Kind.CHARUCO:
                    marker_mm = 0.75 * square_mm if marker_mm is None else marker_mm
                    board = CharucoBoard(
                        columns, rows, square_mm, marker_mm, dictionary, inverted, legacy
                    )
                case _:
                    board = Checkerboard(columns, rows, square_mm)
    with _from_options():
        drawing = draw_sheet(board, page_mm(page), border_mm)
    write_sheet(out, drawing, dots_per_in)
    width_mm, height_mm = board_size_mm(board)
    if as_json:
        show_json(
            {
                "file": str(out),
                "page_mm": [drawing.width_mm, drawing.height_mm],
                "board_mm": [width_mm, height_mm],
                **_square_of(board),
            }
        )
        return
    show(
        f"{out}: {drawing.title}, board {width_mm:g} x {height_mm:g} mm on a page of "
        f"{drawing.width_mm:g} x {drawing.height_mm:g} mm; print at 100 %, then measure the ruler"
    )
    tell_next("target", as_json=False, profile=profile_name or "PROFILE")


def _square_of(board: "Target") -> dict[str, object]:
    from rig.targets import CharucoBoard
    from rig.targets.checkerboard import Checkerboard

    has_squares = isinstance(board, Checkerboard | CharucoBoard)
    return {"square_mm": board.square_mm} if has_squares else {}


def _of_profile(name: str, overrides: list[str]) -> "Target":
    from rig.errors import ConfigError
    from rig.optics.target import target_of
    from rig.profile.load import load_profile

    profile = load_profile(name, overrides)
    if profile.target is None:
        raise ConfigError(
            f"profile {profile.name}: has no [target] to draw", advice="add one, or use --kind"
        )
    return target_of(profile.target)


def _of_file(path: Path, diameter_mm: float | None) -> "Target":
    from rig.export.kalibr_target import read_target
    from rig.optics.target import target_of

    return target_of(read_target(path, diameter_mm))


def _counts(size: str) -> tuple[int, int]:
    columns, cross, rows = size.lower().partition("x")
    if not (cross and columns.isdecimal() and rows.isdecimal()):
        raise typer.BadParameter(f"--size {size}: write COLUMNSxROWS, such as 9x6")
    return int(columns), int(rows)


@contextmanager
def _from_options() -> Generator[None]:
    """What is refused here stands in options, not in a profile."""
    from rig.errors import ConfigError, OptionError

    try:
        yield
    except ConfigError as error:
        raise OptionError(error.found, advice=error.advice) from error
