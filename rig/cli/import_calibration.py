"""`rig import`: another tool's calibration as that of a rig."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.format_choice import choice_of
from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl, Note, Overrides, ProfileName, Tags
from rig.cli.output import show, show_json, tell
from rig.cli.pairs import pairs
from rig.export.formats import formats_of
from rig.export.length_choice import CHOICES

if TYPE_CHECKING:
    from rig.geometry.rig_geometry import RigGeometry


def import_calibration(
    profile_name: ProfileName,
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", help="File or folder of the calibration."),
    ],
    *,
    source: Annotated[
        str | None, choice_of("--format", formats_of("geometry"), "Whose format; else found.")
    ] = None,
    views: Annotated[
        list[str] | None,
        typer.Option(
            "--view",
            metavar="CAMERA=VIEW",
            help="Which view of the profile a camera of the file is; may be given again.",
            show_default=False,
        ),
    ] = None,
    lengths: Annotated[
        str | None,
        choice_of("--lengths", CHOICES, "Unit of the file's lengths; profile: as its places."),
    ] = None,
    note: Note = "",
    tags: Tags = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Take another tool's calibration as that of this rig, or of one of its views.

    Sweeps and captures then rectify with it, and captures have depth without a sweep. It comes
    without a covariance: how sure its depth is follows from what its source is known for, and
    nothing of it is checked against pictures; `rig calibrate` does both. One that was weak when
    `rig export` wrote it stays so: it is kept, not taken by itself, and the exit code is 3.
    """
    from rig.database import open_store, software_versions, this_program
    from rig.export.geometry_import import into_one_view, match_views, read_foreign
    from rig.export.lengths import in_unit, require_plausible
    from rig.export.verdict import quality_of_import
    from rig.geometry.rig_geometry_json import geometry_to_json
    from rig.profile.load import load_profile
    from rig.stored import stored_geometry

    view_of = pairs("--view", views)
    profile = load_profile(profile_name, overrides or ())
    foreign = read_foreign(path, source)
    with open_store(database) as store:
        geometry = foreign.geometry
        if len(geometry.names) == 1 < len(profile.views):
            if lengths is not None:
                raise typer.BadParameter(f"--lengths {lengths}: one camera alone has no lengths")
            stored = store.active_calibration(profile.name, profile.unit)
            others = None if stored is None else stored_geometry(stored)
            geometry = into_one_view(geometry, profile, view_of, others)
        else:
            geometry = match_views(geometry, profile, view_of)
            if lengths is None:
                require_plausible(geometry, profile)
            else:
                geometry = in_unit(geometry, profile, foreign.unit_mm, lengths)
        reference = geometry.cameras[geometry.reference]
        number = store.save_calibration(
            rig=profile.name,
            geometry=geometry_to_json(geometry),
            quality=quality_of_import(foreign.source, path, foreign.weak),
            profile=profile.model_dump(mode="json"),
            versions=software_versions(),
            devices={},
            temperature_degc=None,
            image_size_px=(reference.width_px, reference.height_px),
            active=foreign.weak is None,
            unit=profile.unit,
            note=note,
            provenance=this_program(tags or ()),
        )
    if as_json:
        show_json(
            {
                "calibration": number,
                "rig": profile.name,
                "views": list(geometry.names),
                "format": foreign.source,
                "weak": foreign.weak,
            }
        )
    else:
        show(
            f"calibration {number} of {profile.name}: {len(geometry.names)} views from {path} "
            f"({foreign.source})"
        )
        _show_views(geometry)
    if foreign.weak is not None:
        tell(
            f"rig: {foreign.weak}: so the file says of this calibration; sweeps and captures take "
            f"it only on purpose: --calibration {number}"
        )
        tell_next("import, weak", as_json=as_json, profile=profile_name)
        raise typer.Exit(3)
    tell_next("import", as_json=as_json, profile=profile_name)


def _show_views(geometry: "RigGeometry") -> None:
    for name, camera, centre in zip(
        geometry.names, geometry.cameras, geometry.centres_mm(), strict=True
    ):
        x, y, z = centre
        show(
            f"  {name}: f {camera.fx_px:.2f} px, lens {camera.lens}, at "
            f"{x:+.2f}, {y:+.2f}, {z:+.2f} mm"
        )
