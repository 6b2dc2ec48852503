"""`rig export`: calibrations, sweeps and depth maps in other people's formats."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.options import AsJson, DatabaseUrl
from rig.cli.output import show, show_json
from rig.cli.pairs import pairs
from rig.cli.words import exportable_numbers

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.export.formats import Exported
    from rig.geometry.rig_geometry import RigGeometry


class ExportFormat(StrEnum):
    """What can be written."""

    ROS = "ros"
    KALIBR = "kalibr"
    OPENCV = "opencv"
    DEPTHAI = "depthai"
    MRCAL = "mrcal"
    COLMAP = "colmap"
    CSV = "csv"
    PARQUET = "parquet"
    PLY = "ply"


def export(
    number: Annotated[
        int,
        typer.Argument(
            metavar="ID",
            min=1,
            autocompletion=exportable_numbers,
            help="Number of a calibration; of a sweep for csv and parquet. `rig history` lists "
            "both.",
        ),
    ],
    *,
    target: Annotated[
        ExportFormat, typer.Option("--format", help="Whose format.", show_default=False)
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="PATH",
            help="Folder to write into; the file for csv, parquet and ply.",
            show_default="a name made of ID and format, here",
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
        str,
        typer.Option(
            "--device",
            metavar="ID",
            help="With --flash: id or address of the device.",
            show_default="the only one",
        ),
    ] = "",
    capture: Annotated[
        Path | None,
        typer.Option("--capture", help="ply: folder of `rig capture`.", show_default=False),
    ] = None,
    frame: Annotated[int, typer.Option("--frame", min=0, help="ply: which multi-view.")] = 0,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Write a calibration, the samples of a sweep, or a depth map for other programs.

    Every calibration that is written is read back, and refused unless it puts points to within
    1e-6 px of where the original does. Lengths are in the unit of the format: m for ros, kalibr,
    mrcal and colmap, cm for depthai, mm for the others.
    """
    if (target is ExportFormat.PLY) != (capture is not None):
        raise typer.BadParameter("--capture names the folder of depth maps; it goes with ply")
    if target is not ExportFormat.DEPTHAI and (sockets or device_file):
        raise typer.BadParameter("--socket and --device-json go with depthai")
    _require_flash_options(target, flash, backup, device, device_file)
    if target in (ExportFormat.CSV, ExportFormat.PARQUET):
        _tell(_export_samples(number, target, out, database), as_json)
        return
    geometry, pitch_mm = _calibration(number, database)
    if capture is not None:
        path = out or Path(f"depth_{frame:05d}.ply")
        points = _write_ply(path, geometry, pitch_mm, capture, frame)
        _tell({"calibration": number, "format": "ply", "out": str(path), "points": points}, as_json)
        return

    def write(device_file: Path | None) -> "Exported":
        return _write_geometry(
            geometry,
            target.value,
            out or Path(f"calibration_{number}_{target.value}"),
            refit=refit,
            sockets=pairs("--socket", sockets),
            device_file=device_file,
        )

    exported = write(device_file) if backup is None else _flash(device, backup, write)
    refits = {
        view: {"rms_px": r.rms_px, "largest_px": r.largest_px}
        for view, r in exported.refits.items()
    }
    _tell(
        {
            "calibration": number,
            "format": target.value,
            "out": str(exported.path),
            "gap_px": exported.gap_px,
            "refits": refits,
            "backup": None if backup is None else str(backup),
        },
        as_json,
    )


def _require_flash_options(
    target: ExportFormat, flash: bool, backup: Path | None, device: str, device_file: Path | None
) -> None:
    if (flash or device) and target is not ExportFormat.DEPTHAI:
        raise typer.BadParameter("--flash and --device go with depthai")
    if flash != (backup is not None):
        raise typer.BadParameter("--flash and --backup belong together; give both or none")
    if device and not flash:
        raise typer.BadParameter("--device names the device to --flash")
    if flash and device_file is not None:
        raise typer.BadParameter("--flash starts from what the device holds; omit --device-json")


def _flash(device: str, backup: Path, write: "Callable[[Path | None], Exported]") -> "Exported":
    """Save what a device holds, change its cameras only, and put it back."""
    import json

    from rig.hardware.opening import oak_eeprom

    with oak_eeprom(device) as eeprom:
        eeprom.save(backup)
        exported = write(backup)
        content = json.loads(exported.path.read_text(encoding="utf-8"))
        eeprom.flash(content, backup, may_flash=True)
    return exported


def _export_samples(
    sweep_id: int, target: ExportFormat, out: Path | None, database: str | None
) -> dict[str, object]:
    from rig.database import open_store
    from rig.export.samples import sample_rows

    if target is ExportFormat.CSV:
        from rig.export.samples import write_csv as write_table
    else:
        from rig.export.parquet import write_parquet as write_table
    path = out or Path(f"sweep_{sweep_id}.{target.value}")
    with open_store(database, absent="refused") as store:
        rows = sample_rows(store, sweep_id)
    write_table(path, rows)
    return {"sweep": sweep_id, "format": target.value, "out": str(path), "rows": len(rows)}


def _calibration(number: int, database: str | None) -> "tuple[RigGeometry, float]":
    """Return the geometry of a stored calibration and the view step of its rig, mm."""
    from rig.database import open_store
    from rig.geometry.rig_geometry_json import geometry_from_json
    from rig.profile.load import parse_profile

    with open_store(database, absent="refused") as store:
        stored = store.calibration(number)
    profile = parse_profile(
        dict(stored.profile), source=f"profile stored with calibration {number}"
    )
    return geometry_from_json(stored.geometry), profile.pitch_mm


def _write_geometry(
    geometry: "RigGeometry",
    name: str,
    folder: Path,
    *,
    refit: bool,
    sockets: dict[str, str],
    device_file: Path | None,
) -> "Exported":
    from functools import partial

    from rig.export import depthai
    from rig.export.formats import export_geometry, format_named

    target = format_named(name)
    if target.name != "depthai":
        return export_geometry(geometry, target, folder, may_refit=refit)
    write = partial(depthai.write, sockets=sockets, device=device_file)
    return export_geometry(
        geometry, target, folder, may_refit=refit, write=write, read_names=sockets
    )


def _write_ply(
    path: Path, geometry: "RigGeometry", pitch_mm: float, capture: Path, frame: int
) -> int:
    from rig.depth import read_pfm
    from rig.export.ply import points_of, write_ply
    from rig.geometry.rectification import rectify

    depth_mm = read_pfm(capture / f"depth_{frame:05d}.pfm")
    sigma_mm = read_pfm(capture / f"sigma_{frame:05d}.pfm")
    return write_ply(path, points_of(depth_mm, rectify(geometry, pitch_mm)), sigma_mm)


def _tell(result: dict[str, object], as_json: bool) -> None:
    if as_json:
        show_json(result)
        return
    show(f"{result['out']}: {result['format']}")
    if "rows" in result:
        show(f"{result['rows']} samples of sweep {result['sweep']}")
    elif "points" in result:
        show(f"{result['points']} points in the frame of the reference camera, mm")
    else:
        show(f"read back: points agree to {result['gap_px']:.1g} px")
        if result["backup"] is not None:
            show(f"the device holds it, read back; what it held before is in {result['backup']}")
        refits = result["refits"]
        if isinstance(refits, dict):
            for view, fit in refits.items():
                show(
                    f"note: view {view} has the nearest lens of the format, off by "
                    f"{fit['rms_px']:.3f} px rms, {fit['largest_px']:.3f} px at most"
                )
