"""The pre-flight of the simulated rig, whole and with one fault at a time."""

import signal
import subprocess
import sys
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from rig_drivers.grbl.controller import grbl_stage
from rig_sim.camera import SimCamera
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.faults import CameraFault, FaultyCamera, LateViews, LostViews, UnpluggedCamera
from rig_sim.firmware.grbl import GrblFirmware
from rig_sim.wire import plug
from rig_sim.world import World

from rig.check.check import QUESTIONS, check_rig
from rig.check.items import Item
from rig.check.request import check_request
from rig.curve import Curve, fit_curve
from rig.devices import Stage
from rig.errors import RigError, StoreError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.hardware.opening import Answers
from rig.profile import GrblStageConfig, Profile, SimCameraConfig
from rig.profile.load import load_profile
from rig.records import StoredCalibration
from rig.stored import RunChoice, RunCurve
from tests.support.command import Command
from tests.support.curve_points import exact_sweep
from tests.support.small_sim import SMALL_SIM, as_options

NO_CURVE = StoreError("no curve of this rig", advice="make one with rig sweep")


SWINGING = ("world.carriage.ring_mm=6.0", "world.carriage.ring_decay_s=0.5")
LOOSE = ("world.carriage.backlash_mm=2.0",)


@contextmanager
def bench(
    profile: Profile, *, seen: Profile | None = None, fault: CameraFault | None = None
) -> Generator[Answers]:
    """Open the simulated rig; the world may be one that the profile does not describe."""
    world_profile = seen or profile
    assert world_profile.world is not None
    assert isinstance(profile.camera, SimCameraConfig)
    assert isinstance(profile.stage, GrblStageConfig)
    clock = VirtualClock()
    carriage = Carriage(world_profile.world.carriage, clock)
    firmware = GrblFirmware(world_profile.world.firmware, carriage, clock)
    world = World(world_profile, clock=clock, carriage=carriage, scene="board")
    limits = {"max_skew_s": profile.camera.max_skew_s, "timeout_s": profile.camera.timeout_s}
    with ExitStack() as stack:
        stack.enter_context(plug(profile.stage.port, firmware))
        stage = stack.enter_context(grbl_stage(profile.stage, clock))
        camera = SimCamera(profile.camera, world)
        faulty = camera if fault is None else FaultyCamera(camera, fault, clock=clock, **limits)
        yield Answers(stack.enter_context(faulty), stage, clock)


def check(
    *overrides: str,
    world: tuple[str, ...] = (),
    fault: CameraFault | None = None,
    moves: bool = True,
    curve: RunCurve | RigError = NO_CURVE,
    database: str,
) -> dict[str, Item]:
    profile = load_profile("sim", (*SMALL_SIM, *overrides))
    seen = load_profile("sim", (*SMALL_SIM, *overrides, *world))
    request = replace(check_request(profile, RunChoice(database), moves=moves), curve=curve)
    with bench(profile, seen=seen, fault=fault) as answers:
        return {item.name: item for item in check_rig(request, answers, print)}


@pytest.fixture
def database(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path}/rig.sqlite"


def true_curve() -> Curve:
    """The law of the small simulated rig in closed form: 305 px, 40 mm pitch, focus at 700 mm."""
    return fit_curve(exact_sweep(lambda z_mm: 305.0 * 40.0 * (1.0 / z_mm - 1.0 / 700.0))).best


@pytest.mark.parametrize(
    ("fault", "item", "found", "advice"),
    [
        (LostViews(("left",)), "camera", "nothing came from left", "cable and power"),
        (UnpluggedCamera(after=3), "camera", "stopped answering", "cable and power"),
        (LateViews(("top",), late_s=0.02), "skew", "20.00 ms apart", "hardware sync"),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, str) else value,
)
def test_a_camera_that_fails_is_told_and_the_check_goes_on(
    database: str, fault: CameraFault, item: str, found: str, advice: str
):
    items = check(fault=fault, moves=False, database=database)
    assert items[item].status == "fail"
    assert found in items[item].found
    assert advice in items[item].advice
    assert items["stage"].status == "pass"
    assert items["database"].status == "pass"


def test_views_a_little_late_are_a_warning(database: str):
    late = LateViews(("top",), late_s=0.004)
    skew = check(fault=late, moves=False, database=database)["skew"]
    assert skew.status == "warn"
    assert skew.numbers["p95_ms"] == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("world", "item", "found", "advice"),
    [
        ("world.view_errors.left.gain=0.08", "exposure", "left 2%-8%", "left: lengthen"),
        pytest.param(
            "world.view_errors.left.gain=6.0",
            "exposure",
            "saturated",
            "left: shorten",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "world.view_errors.left.gain=40.0",
            "board",
            "left: 9 x 6 board",
            "dim the light",
            marks=pytest.mark.slow,
        ),
        ("world.optics.blur_px=2.2", "focus", "too blurred", "focus centre, left"),
        ("target.columns=8", "board", "found one of 8 x 6", "columns and rows to 8 x 6"),
        pytest.param(
            "world.board_offset_mm=[400.0, 0.0]",
            "board",
            "5 of 5 views",
            "move the board",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_picture_that_is_not_good_enough_is_told(
    database: str, world: str, item: str, found: str, advice: str
):
    items = check(world=(world,), moves=False, database=database)
    assert items[item].status == "fail"
    assert found in items[item].found
    assert advice in items[item].advice
    assert items["camera"].status == items["rate"].status == "pass"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("overrides", "world", "item", "advice"),
    [
        ((), SWINGING, "settling", "sweep.settle_s"),
        (("stage.approach_mm=0.0",), LOOSE, "repeatability", "play of"),
        ((), ("world.board_offset_mm=[130.0, 0.0]",), "reach", "start at 479 mm"),
    ],
)
def test_a_stage_or_board_that_is_not_good_enough_is_told(
    database: str, overrides: tuple[str, ...], world: tuple[str, ...], item: str, advice: str
):
    items = check(*overrides, world=world, database=database)
    assert items[item].status == "fail"
    assert advice in items[item].advice
    assert items["camera"].status == items["board"].status == "pass"


@pytest.mark.slow
def test_a_good_rig_passes_and_its_numbers_are_those_of_the_world(database: str):
    items = check(curve=RunCurve(7, true_curve(), sweep_id=5), database=database)
    assert {item.name for item in items.values() if item.status == "fail"} == set()
    assert items["reach"].status == "warn"  # squares of 6.4 px at the far end of the small picture
    assert items["geometry"].status == "skip"
    electrons = items["noise"].numbers["electrons_per_level"]
    assert electrons == {view: pytest.approx(40.0, rel=0.04) for view in items_views(electrons)}
    assert items["rate"].numbers["reached_hz"] == pytest.approx(30.0, rel=1e-3)
    play_mm = items["repeatability"].numbers["play_mm"]
    assert play_mm == pytest.approx(0.0, abs=0.1)
    assert items["curve"].status == "pass"
    assert items["curve"].numbers["error_mm"] == pytest.approx(0.0, abs=0.4)


def items_views(values: object) -> list[str]:
    assert isinstance(values, dict)
    assert len(values) == 5
    return list(values)


@pytest.mark.slow
def test_a_plan_beyond_the_travel_fails_and_the_rest_is_checked_within_it(database: str):
    items = check("stage.travel_mm=[500.0, 900.0]", database=database)
    assert items["travel"].status == "fail"
    assert "travel from 500.0 to 900.0 mm" in items["travel"].found
    assert "500, 700, 900 mm" in items["reach"].found
    assert items["repeatability"].status == "pass"


@pytest.mark.slow
def test_a_rig_that_moved_since_its_sweep_is_told(database: str):
    moved = ("world.carriage.board_at_machine_zero_mm=1213",)
    curve = check(world=moved, curve=RunCurve(7, true_curve(), sweep_id=5), database=database)[
        "curve"
    ]
    assert curve.status == "fail"
    assert "curve 7" in curve.found
    assert curve.numbers["error_mm"] == pytest.approx(10.0, abs=1.0)
    assert "sweep again" in curve.advice


def test_a_stage_that_never_answers_leaves_the_camera_to_be_checked(rig: Command):
    answer = rig("check", "sim", *as_options(), "--set", "stage.port=/dev/does-not-exist", "--json")
    assert answer.code == 3
    items = {item["item"]: item for item in answer.json["items"]}
    assert items["stage"]["status"] == "fail"
    assert "/dev/does-not-exist" in items["stage"]["found"]
    assert items["camera"]["status"] == "pass"
    assert "not ready to sweep" in answer.err


def test_a_controller_that_does_not_allow_what_the_profile_says_is_told(rig: Command):
    limits = ("--set", "world.firmware.travel_mm=500.0", "--no-move", "--json")
    answer = rig("check", "sim", *as_options(), *limits)
    assert answer.code == 3
    items = {item["item"]: item for item in answer.json["items"]}
    assert items["stage"]["status"] == "fail"
    assert "$130" in items["stage"]["found"]
    assert items["camera"]["status"] == "pass"


def test_no_move_leaves_the_stage_alone(database: str):
    items = check(moves=False, database=database)
    assert {name for name, item in items.items() if item.status == "skip"} == {
        "settling", "curve", "reach", "repeatability", "geometry",
    }  # fmt: skip
    assert "left alone" in items["stage"].found
    assert "home" in items["reach"].advice


def test_a_profile_that_forbids_to_move_is_kept(database: str):
    items = check("stage.may_move=false", database=database)
    assert items["stage"].status == "warn"
    assert items["repeatability"].status == "skip"


def test_a_geometry_is_asked_with_one_picture_of_the_check(database: str):
    """Cameras 40 mm apart on paper, of another focal length than the world's."""
    profile = load_profile("sim", SMALL_SIM)
    names = tuple(view.name for view in profile.views)
    places_mm = [np.array([40.0 * v.x_steps, 40.0 * v.y_steps, 0.0]) for v in profile.views]
    geometry = RigGeometry(
        names,
        profile.reference,
        (CameraModel(320, 200, 250.0, 250.0, 159.5, 99.5),) * len(names),
        tuple(Pose(np.eye(3), -place_mm) for place_mm in places_mm),
        np.diag(np.full(4 * len(names) + 6 * (len(names) - 1), 1e-8)),
    )
    stored = StoredCalibration(
        id=3, rig="sim", created_at=datetime(2026, 5, 4, tzinfo=UTC),
        geometry=geometry_to_json(geometry), quality={}, profile={}, versions={}, devices={},
        temperature_degc=None, image_size_px=(320, 200), active=True,
    )  # fmt: skip
    request = check_request(profile, RunChoice(database), moves=False)
    request = replace(request, run=replace(request.run, calibration=stored))
    with bench(profile) as answers:
        item = list(check_rig(request, answers, print))[-1]
    assert (item.name, item.status) == ("geometry", "fail")
    assert "calibration 3 of 2026-05-04" in item.found


@pytest.mark.parametrize(
    ("fault", "cause"),
    [(LostViews(("left",)), "camera"), (UnpluggedCamera(after=3), "camera"),
     (LateViews(("top",), late_s=0.02), "skew")],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)  # fmt: skip
def test_what_a_fault_leaves_open_is_listed_with_the_reason(
    database: str, fault: CameraFault, cause: str
):
    items = check(fault=fault, moves=False, database=database)
    assert set(items) == set(QUESTIONS)
    open_ = [item for item in items.values() if f"{cause} failed, see there" in item.found]
    assert open_
    assert {item.status for item in open_} == {"skip"}


def test_what_the_profile_does_not_have_is_listed_as_skipped(database: str):
    profile = load_profile("sim", SMALL_SIM)
    bare = profile.model_copy(update={"stage": None, "sweep": None, "target": None})
    request = check_request(bare, RunChoice(database), moves=True)
    with bench(profile) as answers:
        items = {
            item.name: item for item in check_rig(request, replace(answers, stage=None), print)
        }
    assert set(items) == set(QUESTIONS)
    assert "no [stage]" in items["travel"].found
    assert "no [sweep]" in items["disk"].found
    assert "no [target]" in items["geometry"].found
    assert "no [stage], the profile has no [sweep]" in items["reach"].found


def test_whatever_ends_a_check_early_leaves_the_stage_stopped(database: str):
    profile = load_profile("sim", SMALL_SIM)
    request = check_request(profile, RunChoice(database), moves=True)
    with bench(profile) as answers:
        stage = Watched(answers.stage)
        told: list[str] = []
        items = check_rig(request, replace(answers, stage=stage), told.append)
        for item in items:
            if item.name == "reach":
                break
        assert stage.stops == 0
        with pytest.raises(KeyboardInterrupt):
            items.throw(KeyboardInterrupt)
        assert stage.stops == 1
        assert told == ["the check ended early, the stage stands still"]


def test_the_verb_shows_a_table_and_what_to_do(rig: Command):
    answer = rig("check", "sim", *as_options(), "--no-move", "--set", "views.left.x_steps=-0.93")
    assert answer.code == 0
    assert "WARN  arrangement" in answer.out
    assert "-> shift one view" in answer.out
    assert "1 warn, 0 fail" in answer.out


def test_a_database_that_takes_nothing_is_told(rig: Command, tmp_path: Path):
    (tmp_path / "file").write_text("")
    answer = rig(
        "check", "sim", *as_options(), "--no-move", "--db", f"sqlite:///{tmp_path}/file/rig.sqlite"
    )
    assert answer.code == 3
    assert "FAIL  database" in answer.out


@pytest.mark.slow
def test_ctrl_c_stops_the_stage(rig: Command):
    program = [sys.executable, "-c", "from rig.cli import main; main()"]
    slow = ("--set", "world.clock=real", "--set", "stage.speed_mm_s=20")
    with subprocess.Popen(
        [*program, "check", "sim", *as_options(), *slow],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if "stage" in line.split()[:2]:
                break
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "the stage stands still" in errors


class Watched:
    """A stage that counts how often it is stopped."""

    def __init__(self, stage: Stage | RigError | None) -> None:
        assert not isinstance(stage, RigError | None)
        self._stage = stage
        self.stops = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self._stage, name)

    def stop(self) -> None:
        self.stops += 1
        self._stage.stop()


def test_what_comes_next_depends_on_whether_the_stage_has_moved(rig: Command):
    assert "next: rig calibrate sim, or rig sweep sim" in rig("check", "sim", *as_options()).err
    left_alone = rig("check", "sim", *as_options(), "--no-move")
    assert "next: rig check sim with its stage" in left_alone.err
