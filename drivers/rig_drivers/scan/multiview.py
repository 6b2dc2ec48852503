"""From the takes of a scan to one multi-view, or to the reason why there is none."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from rig.errors import SceneMovedError
from rig.frames import MultiView
from rig.profile.scan_camera import REFERENCE
from rig.scan import Scan, ScanFacts, ScanTimes, Take
from rig_drivers.scan.brightness import Light, in_one_light, lights
from rig_drivers.scan.kept import Keeping, Kept
from rig_drivers.scan.rest import find_motion, show_motion


def multiview_of(
    keeping: Keeping, names: Sequence[str], times: ScanTimes, *, tolerance_px: float, name: str
) -> MultiView:
    """Return the views of a complete scan, in one light.

    Args:
        keeping: holds all takes; is told how the scan ended.
        names: of the views, in the order of the profile.
        times: of the scan.
        tolerance_px: how far the scene may move between takes of the reference.
        name: of the camera, for messages.

    Raises:
        SceneMovedError: the scene was not at rest.
    """
    takes = keeping.taken
    reference = [take for take in takes if take.halt.view == REFERENCE]
    _require_rest(keeping, reference, tolerance_px, name)
    views = {take.halt.view: i for i, take in enumerate(takes) if take.halt.role == "view"}
    light = lights(takes, takes[views[REFERENCE]])
    frames = tuple(
        replace(takes[i].frame, view=view, image=in_one_light(takes[i].frame, light[i]))
        for view, i in ((view, views[view]) for view in names)
    )
    facts = ScanFacts(tuple(map(_fact, takes, light)), times)
    shown = tuple(replace(take.frame, view=REFERENCE) for take in reference)
    keeping.end("complete")
    return MultiView(frames, takes[-1].temperature_degc, Scan(facts, shown))


def _require_rest(
    keeping: Keeping, reference: Sequence[Kept], tolerance_px: float, name: str
) -> None:
    for before, after in pairwise(reference):
        motion = find_motion(before.frame, after.frame, tolerance_px)
        if motion is None:
            continue
        picture = ""
        if keeping.folder is not None:
            picture = str(keeping.folder / "moved.png")
            show_motion(after.frame, motion, keeping.folder / "moved.png")
        keeping.end("moved")
        left, top, right, bottom = motion.region_px
        shown = f", see {picture}" if picture else ""
        raise SceneMovedError(
            name,
            f"the scene moved during the scan: between its {before.halt.role} and its "
            f"{after.halt.role} take the reference view changed by {motion.change_levels:.1f} grey "
            f"levels (rms) at x {left}..{right}, y {top}..{bottom} px{shown}",
            advice="keep scene, light and mount at rest and scan again; `rig check` tells how long "
            "to settle",
            region_px=motion.region_px,
            picture=picture,
        )


def _fact(take: Kept, light: Light) -> Take:
    row_mm, *column = take.reached_mm
    return Take(
        view=take.halt.view,
        role=take.halt.role,
        row_mm=row_mm,
        column_mm=column[0] if column else None,
        timestamp_s=take.frame.timestamp_s,
        session=take.session,
        temperature_degc=take.temperature_degc,
        gain=light.gain,
        offset_levels=light.offset_levels,
    )
