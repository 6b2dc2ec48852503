"""`rig import`: another tool's calibration as that of a rig."""

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.format_choice import choice_of
from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, DatabaseUrl, Note, Overrides, ProfileName, Tags
from rig.cli.output import show, show_json
from rig.cli.pairs import pairs
from rig.export.formats import formats_of


def import_calibration(
    profile_name: ProfileName,
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", help="File, or folder for ros, opencv, mrcal, colmap."),
    ],
    *,
    source: Annotated[str, choice_of("--format", formats_of("geometry"), "Whose format.")],
    views: Annotated[
        list[str] | None,
        typer.Option(
            "--view",
            metavar="CAMERA=VIEW",
            help="Which view of the profile a camera of the file is; may be given again.",
            show_default=False,
        ),
    ] = None,
    note: Note = "",
    tags: Tags = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Take another tool's calibration as that of this rig.

    Sweeps and captures then rectify with it, and captures have depth without a sweep. It comes
    without a covariance: how sure its depth is follows from what its source is known for, and
    nothing of it is checked against pictures; `rig calibrate` does both.
    """
    from rig.database import open_store, software_versions, this_program
    from rig.export.geometry_format import geometry_format
    from rig.export.geometry_import import match_views
    from rig.geometry.rig_geometry_json import geometry_to_json
    from rig.profile.load import load_profile

    view_of = pairs("--view", views)
    profile = load_profile(profile_name, overrides or ())
    geometry = match_views(geometry_format(source).read(path), profile, view_of)
    reference = geometry.cameras[geometry.reference]
    with open_store(database) as store:
        number = store.save_calibration(
            rig=profile.name,
            geometry=geometry_to_json(geometry),
            quality={"imported": source, "from": str(path)},
            profile=profile.model_dump(mode="json"),
            versions=software_versions(),
            devices={},
            temperature_degc=None,
            image_size_px=(reference.width_px, reference.height_px),
            unit=profile.unit,
            note=note,
            provenance=this_program(tags or ()),
        )
    if as_json:
        show_json({"calibration": number, "rig": profile.name, "views": list(geometry.names)})
        return
    show(f"calibration {number} of {profile.name}: {len(geometry.names)} views from {path}")
    for name, camera, centre in zip(
        geometry.names, geometry.cameras, geometry.centres_mm(), strict=True
    ):
        x, y, z = centre
        show(
            f"  {name}: f {camera.fx_px:.2f} px, lens {camera.lens}, at "
            f"{x:+.2f}, {y:+.2f}, {z:+.2f} mm"
        )
    tell_next("import", as_json=False, profile=profile_name)
