"""What a check looks at, with what is stored about the rig."""

from dataclasses import dataclass

from rig.check.items import Item, failed
from rig.check.storage import judge_database
from rig.database import Store, open_store
from rig.errors import RigError, StoreError
from rig.optics.nominal import nominal_optics
from rig.profile import Profile
from rig.stored import Run, RunChoice, RunCurve, find_curve, open_run


@dataclass(frozen=True, slots=True)
class CheckRequest:
    """What a check is to look at."""

    run: Run
    """The rig, with its calibration if it has one."""
    curve: RunCurve | RigError
    """Newest of the rig, or why there is none."""
    database: Item
    """Whether the database takes a sweep."""
    url: str | None
    """Of the database, as for every verb."""
    moves: bool
    """Whether the stage may be moved, where the profile allows it as well."""

    @property
    def profile(self) -> Profile:
        """The rig."""
        return self.run.profile


def check_request(profile: Profile, choice: RunChoice, *, moves: bool) -> CheckRequest:
    """Look up what is stored about a rig; a database that fails is an item and ends no check.

    Raises:
        ConfigError: the calibration does not fit the rig.
        StoreError: there is no such calibration as was asked for.
    """
    try:
        with open_store(choice.database, absent="empty") as store:
            run = open_run(store, profile, choice.calibration, "none")
            return CheckRequest(
                run,
                _curve_or_reason(store, run),
                judge_database(store),
                choice.database,
                moves,
            )
    except StoreError as error:
        if choice.calibration is not None:
            raise
        run = Run(profile, nominal_optics(profile))
        return CheckRequest(run, error, failed("database", error), choice.database, moves)


def _curve_or_reason(store: Store, run: Run) -> RunCurve | RigError:
    try:
        return find_curve(store, run)
    except RigError as error:
        return error


def missing_sections(profile: Profile) -> list[str]:
    """Return the sections without which no board is carried."""
    sections = {"stage": profile.stage, "sweep": profile.sweep, "target": profile.target}
    return [name for name, section in sections.items() if section is None]
