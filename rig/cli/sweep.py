"""`rig sweep`: the depth-slope sweep."""

from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.conclusion import show_result
from rig.cli.next_verb import tell_next
from rig.cli.options import (
    AsJson,
    CalibrationChoice,
    DatabaseUrl,
    Note,
    Overrides,
    ProfileName,
    Tags,
    finite,
)
from rig.cli.output import show, show_json, table, tell
from rig.cli.page_options import View, ViewHost, ViewPort, page_request, sweep_page
from rig.limits import MOST_SAMPLES, MOST_STOPS

if TYPE_CHECKING:
    from rig.plan import Stop
    from rig.sweep.take import SweepTimes

_PROFILE = "as in the profile"


def sweep(
    profile_name: ProfileName,
    more: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[ID | MM...]",
            help="After --resume: number of the sweep. After --at-mm: further distances.",
            show_default=False,
        ),
    ] = None,
    *,
    from_mm: Annotated[
        float | None,
        typer.Option("--from-mm", help="First distance.", show_default=_PROFILE, callback=finite),
    ] = None,
    to_mm: Annotated[
        float | None,
        typer.Option("--to-mm", help="Last distance.", show_default=_PROFILE, callback=finite),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(
            "--count",
            min=2,
            max=MOST_STOPS,
            help="Distances, both ends included.",
            show_default=_PROFILE,
        ),
    ] = None,
    at_mm: Annotated[
        list[str] | None,
        typer.Option(
            "--at-mm",
            metavar="MM...",
            help="Visit exactly these distances: 400 500 650, or 400,500,650.",
            show_default=False,
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            min=1,
            max=MOST_SAMPLES,
            help="Multi-views per stop.",
            show_default=_PROFILE,
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with an interrupted sweep of this rig.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan and its estimated time; move nothing.")
    ] = False,
    calibration: CalibrationChoice = None,
    note: Note = "",
    tags: Tags = None,
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Move the board through known distances and measure slope against distance.

    Every sample is stored before the next is taken: after Ctrl-C, a crash or a lost device,
    `rig sweep PROFILE --resume` goes on. Distances count from the optical centre of the reference
    camera. Ends with the depth error at distances that the fit has not seen; exit code 3 says
    that it misses the profile's limits.
    """
    from rig.cli.progress import ProgressLine
    from rig.database import open_store
    from rig.hardware.opening import open_hardware
    from rig.interrupts import saying
    from rig.profile.load import load_profile
    from rig.report import write_report
    from rig.sweep.job import new_sweep, owned_to_resume
    from rig.sweep.request import SweepRequest, plan_of, planned_times
    from rig.sweep.second_opinion import SecondOpinion
    from rig.sweep.sweep import conclude_taken, sweep_and_conclude

    more = more or []
    if more and not (resume or at_mm):
        raise typer.BadParameter(f"{' '.join(more)}: give distances after --at-mm")
    if from_mm is not None and from_mm == to_mm:
        raise typer.BadParameter(f"--from-mm and --to-mm are both {from_mm:g}; give two ends")
    if at_mm and (resume or not (from_mm is to_mm is count is None)):
        raise typer.BadParameter("--at-mm stands alone, without --from-mm, --to-mm, --count")
    if resume and (note or tags):
        raise typer.BadParameter("a resumed sweep keeps its note and tags")
    if resume and calibration is not None:
        raise typer.BadParameter("a resumed sweep keeps its calibration; rig fit changes it")
    page = page_request(view_host, view_port, is_wanted=view)
    resumed = _sweep_number(more) if resume else None
    profile = load_profile(profile_name, overrides or ())
    distances_mm = tuple(_numbers([*(at_mm or []), *more])) if at_mm else ()
    request = SweepRequest(from_mm, to_mm, count, distances_mm, samples)
    if dry_run:
        stops, planned_samples = plan_of(profile, request)
        _show_plan(stops, planned_samples, planned_times(profile, stops, planned_samples), as_json)
        tell_next("sweep, dry run", as_json=as_json, profile=profile_name)
        return
    with (
        open_store(database, absent="refused" if resume else "made") as store,
        ExitStack() as owning,
    ):
        if resume:  # its owner first: to open a stage resets it, and it may be at work
            job = owning.enter_context(owned_to_resume(store, profile, resumed))
        else:
            job = new_sweep(store, profile, request, calibration)
            job = replace(job, note=note, tags=tuple(tags or ()))
        if job.run.origin is not None:
            tell(job.run.origin)
        if job.is_taken:
            result = conclude_taken(job, store, tell)
        else:
            with (
                ProgressLine(job.total) as progress,
                sweep_page(page, progress.tell) as shown,
                open_hardware(job.run.profile, shown.bystander) as hardware,
            ):
                watcher = SecondOpinion(progress.tell, shown.watcher)
                result = sweep_and_conclude(job, hardware, store, progress.report, tell, watcher)
        number = result.sweep_id
        with saying(
            lambda: f"sweep {number} and its curve are stored; its page: rig report {number}"
        ):
            write_report(store, result)
    show_result(result, as_json=as_json, profile_name=profile_name)


def _numbers(texts: list[str]) -> list[float]:
    try:
        numbers = [float(part) for text in texts for part in text.split(",") if part]
    except ValueError as error:
        raise typer.BadParameter(f"{' '.join(texts)}: distances are numbers in mm") from error
    for number in numbers:
        finite(number)
    if len(set(numbers)) < len(numbers):
        raise typer.BadParameter(f"{' '.join(texts)}: give every distance once")
    return numbers


def _sweep_number(more: list[str]) -> int | None:
    if not more:
        return None
    if len(more) > 1 or not more[0].isdecimal() or int(more[0]) < 1:
        raise typer.BadParameter(f"{' '.join(more)}: after --resume comes one sweep number")
    return int(more[0])


def _show_plan(stops: "tuple[Stop, ...]", samples: int, times: "SweepTimes", as_json: bool) -> None:
    if as_json:
        show_json(
            {
                "stops": [
                    {"distance_mm": s.distance_mm, "role": s.role, "direction": s.direction}
                    for s in stops
                ],
                "samples": samples,
                "estimated_s": times.needed_s,
            }
        )
        return
    rows = [[str(s.index), f"{s.distance_mm:.3f}", s.role, s.direction] for s in stops]
    for line in table(rows, ("stop", "distance mm", "role", "direction")):
        show(line)
    show(
        f"{len(stops)} stops x {samples} samples, about {times.needed_s:.0f} s after homing: "
        f"moves {times.moves_s:.0f} s, settling {times.settling_s:.0f} s, "
        f"exposures {times.exposures_s:.0f} s; nothing was moved"
    )
