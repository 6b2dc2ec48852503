"""`rig calibrate --from-scene`: its options, and what it prints."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from rig.cli.next_verb import tell_next
from rig.cli.output import show, show_json, tell

if TYPE_CHECKING:
    from rig.calibrate.from_scene import SceneResult
    from rig.database import Store
    from rig.epipolar.scene.found import LensTerms
    from rig.profile import Profile


@dataclass(frozen=True, slots=True)
class SceneChoices:
    """What the command line says."""

    profile: "Profile"
    profile_name: str
    start: int | None
    lens: str
    pictures: int
    note: str
    tags: tuple[str, ...]


def refuse_others(**given: bool) -> None:
    """Refuse options that mean nothing without a target."""
    named = [f"--{name}" for name, is_given in given.items() if is_given]
    if named:
        raise typer.BadParameter(
            f"{', '.join(named)} with --from-scene: leave it out, no target takes part"
        )


def from_scenes(store: "Store", choices: SceneChoices, *, as_json: bool) -> None:
    """Calibrate from scenes, and print the result; exit code 3 says that it is weak."""
    from rig.calibrate.from_scene import (
        MOST_SCENES,
        SceneRequest,
        calibrate_from_scene,
        scene_lines,
    )
    from rig.calibrate.take import Operator
    from rig.cli.progress import ProgressLine
    from rig.interrupts import Interrupts

    terms = _lens_terms(choices.lens)
    request = SceneRequest(
        choices.profile,
        choices.start,
        terms,
        min(choices.pictures, MOST_SCENES),
        choices.note,
        choices.tags,
    )
    with Interrupts() as interrupts, ProgressLine(None) as progress:
        operator = Operator(interrupts, progress.report, tell)
        result = calibrate_from_scene(request, store, operator)
    if as_json:
        show_json(_as_dict(result))
    else:
        for line in scene_lines(result):
            show(line)
    if not result.verdict.good:
        tell(
            "rig: weak calibration; sweeps and captures take it only on purpose: "
            f"--calibration {result.calibration_id}"
        )
        tell_next("calibrate, weak", as_json=as_json, profile=choices.profile_name)
        raise typer.Exit(3)
    tell_next("calibrate, scene", as_json=as_json, profile=choices.profile_name)


def _lens_terms(lens: str) -> "LensTerms":
    match lens:
        case "auto":
            return "auto"
        case "none":
            return "kept"
        case "brown5":
            return "freed"
        case _:
            raise typer.BadParameter(
                f"--lens {lens} with --from-scene: give auto, none (keep lenses) or brown5 (find "
                "their terms)"
            )


def _as_dict(result: "SceneResult") -> dict[str, object]:
    verdict = result.verdict
    return {
        "calibration": result.calibration_id,
        "rig": result.rig,
        "database": result.database,
        "file": str(result.file),
        "scenes": result.scenes,
        **result.quality,
        "verdict": {
            "good": verdict.good,
            "reasons": [{"code": reason.code, "text": reason.text} for reason in verdict.reasons],
            "notes": list(verdict.notes),
        },
    }
