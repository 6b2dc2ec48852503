"""`rig export`: calibrations, sweeps and captures in other people's formats."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.format_choice import choice_of
from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json, tell
from rig.cli.pairs import pairs
from rig.cli.words import exportable_numbers
from rig.export.formats import capture_formats, formats_of, written_formats

if TYPE_CHECKING:
    from rig.export.exported import Exported, ExportedGeometry


def export(
    source: Annotated[
        str,
        typer.Argument(
            metavar="ID|CAPTURE",
            autocompletion=exportable_numbers,
            help="Number of a calibration; of a sweep for "
            f"{' and '.join(formats_of('samples'))}: `rig history` lists both. Or the folder of "
            f"`rig capture --out` for {', '.join(capture_formats())}.",
        ),
    ],
    *,
    target: Annotated[str, choice_of("--format", written_formats(), "Whose format.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="PATH",
            help="Folder to write into; the file for csv, parquet and ply of an ID.",
            show_default="a name made of ID or CAPTURE and format, here",
        ),
    ] = None,
    refit: Annotated[
        bool,
        typer.Option(
            "--refit",
            help="Replace a lens that the format cannot hold by the nearest it can, and say by "
            "how many px it is off.",
        ),
    ] = False,
    sockets: Annotated[
        list[str] | None,
        typer.Option(
            "--socket",
            metavar="VIEW=CAM_X",
            help="depthai: which socket a view is; may be given again.",
            show_default=False,
        ),
    ] = None,
    device_file: Annotated[
        Path | None,
        typer.Option(
            "--device-json",
            help="depthai: the device's own calibration, whose other contents are kept.",
            show_default=False,
        ),
    ] = None,
    flash: Annotated[
        bool,
        typer.Option(
            "--flash",
            help="depthai: also write it into the EEPROM of the device, in place of the factory's; "
            "needs --backup.",
        ),
    ] = False,
    backup: Annotated[
        Path | None,
        typer.Option(
            "--backup",
            help="With --flash: new file for what the EEPROM held before.",
            show_default=False,
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(
            "--device",
            metavar="ID",
            help="With --flash: id or address of the device.",
            show_default="the only one",
        ),
    ] = None,
    capture: Annotated[
        Path | None,
        typer.Option(
            "--capture", help="ply of an ID: folder of `rig capture`.", show_default=False
        ),
    ] = None,
    frame: Annotated[
        int | None,
        typer.Option("--frame", min=0, help="ply of an ID: which multi-view.", show_default="0"),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option(
            "--frames",
            metavar="0,5-9",
            help="CAPTURE: which of its frames.",
            show_default="all",
        ),
    ] = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Write a calibration, the samples of a sweep, or the frames of a capture for other programs.

    Every calibration that is written is read back, and refused unless it puts points to within
    1e-6 px of where the original does. Lengths are in the unit of the format: m for ros, kalibr,
    mrcal and colmap, cm for depthai, mm for the others.
    """
    from rig.errors import ConfigError
    from rig.export.formats import exporter_for
    from rig.export.stored import export_stored

    options = {
        "refit": refit or None,
        "socket": pairs("--socket", sockets) or None,
        "device_json": device_file,
        "flash": flash or None,
        "backup": backup,
        "device": device,
        "capture": capture,
        "frame": frame,
        "frames": frames,
    }
    given: dict[str, object] = {name: value for name, value in options.items() if value is not None}
    if not source.isdecimal():
        _export_capture(Path(source), target, given, out, as_json=as_json)
        return
    number = int(source)
    if number < 1:
        raise typer.BadParameter(f"ID {number}: numbers begin with 1")
    try:
        exporter = exporter_for(target, given)
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from error
    exported = export_stored(exporter, number, out, database)
    _warn_of_weak(number, exported)
    if as_json:
        show_json(_as_dict(number, target, exported))
    else:
        _show(number, target, exported)
    tell_next("export", as_json=as_json)


def _export_capture(
    source: Path, target: str, given: dict[str, object], out: Path | None, *, as_json: bool
) -> None:
    from rig.errors import ConfigError
    from rig.export.formats import capture_exporter_for

    try:
        exporter = capture_exporter_for(target, given)
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from error
    exported = exporter.export(source, out)
    if as_json:
        show_json(
            {
                "capture": str(source),
                "format": target,
                "out": str(exported.path),
                "frames": exported.frames,
                "points": exported.points,
            }
        )
        return
    points = "" if exported.points is None else f", {exported.points} points"
    frames = f"{exported.frames} frame{'' if exported.frames == 1 else 's'}"
    show(f"{exported.path}: {target}, {frames} of {source}{points}")
    tell_next("export", as_json=as_json)


def _warn_of_weak(number: int, exported: "Exported") -> None:
    from rig.export.exported import ExportedGeometry

    if isinstance(exported, ExportedGeometry) and exported.weak is not None:
        also = (
            "the files say so in a comment"
            if exported.tells_weak
            else "this format cannot say so, tell whoever gets it"
        )
        tell(f"rig: calibration {number} is {exported.weak}; {also}")


def _as_dict(number: int, target: str, exported: "Exported") -> dict[str, object]:
    from rig.export.exported import ExportedDepth, ExportedSamples

    where: dict[str, object] = {"format": target, "out": str(exported.path)}
    match exported:
        case ExportedSamples():
            return {"sweep": number, **where, "rows": exported.rows}
        case ExportedDepth():
            return {"calibration": number, **where, "points": exported.points}
        case _:
            return {"calibration": number, **where, **_geometry_as_dict(exported)}


def _geometry_as_dict(exported: "ExportedGeometry") -> dict[str, object]:
    return {
        "gap_px": exported.gap_px,
        "refits": {
            view: {"rms_px": refit.rms_px, "largest_px": refit.largest_px}
            for view, refit in exported.refits.items()
        },
        "backup": None if exported.backup is None else str(exported.backup),
        "weak": exported.weak,
    }


def _show(number: int, target: str, exported: "Exported") -> None:
    from rig.export.exported import ExportedDepth, ExportedSamples

    show(f"{exported.path}: {target}")
    match exported:
        case ExportedSamples():
            show(f"{exported.rows} samples of sweep {number}")
        case ExportedDepth():
            show(f"{exported.points} points in the frame of the reference camera, mm")
        case _:
            _show_geometry(exported)


def _show_geometry(exported: "ExportedGeometry") -> None:
    show(f"read back: points agree to {exported.gap_px:.1g} px")
    if exported.backup is not None:
        show(f"the device holds it, read back; what it held before is in {exported.backup}")
    for view, refit in exported.refits.items():
        show(
            f"note: view {view} has the nearest lens of the format, off by "
            f"{refit.rms_px:.3f} px rms, {refit.largest_px:.3f} px at most"
        )
