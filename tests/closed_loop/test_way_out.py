"""Every way out of a verb, from its first line to its last: signals at known points of the work."""

import signal
from pathlib import Path

import pytest

from rig.database import Store, open_store
from rig.folder_lock import LOCK_FILE
from tests.support.command import Command
from tests.support.multiviews import noisy_multiview
from tests.support.signalled import STILL, Ended, run_signalled
from tests.support.small_sim import as_options
from tests.support.stores import STOPS, new_sweep, sqlite_url

ALL = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
KEPT = "rig: interrupted; what was stored before is kept"
HOME = "call:rig_sim.firmware.grbl.program:home"
MOVE = "call:rig_sim.carriage:Carriage.follow"
GRAB = "call:rig_sim.camera:SimCamera.grab"
OPEN = "call:rig_drivers.stage.serial_stage:SerialStage.__enter__"
CLOSE = "call:rig_drivers.stage.serial_stage:SerialStage.__exit__"
CONCLUDE = "call:rig.sweep.conclude:fit_curve"
WRITE = "call:rig.report:write_report"
LAST = "call:rig.cli:_flushed"
SHUT = "call:sqlalchemy.engine.default:DefaultDialect.do_close"
slow = pytest.mark.slow


@pytest.fixture
def database(tmp_path: Path) -> str:
    return sqlite_url(tmp_path)


def sweep_with(number: int, point: str, database: str, *more: str, fault: str | None = None):
    plan = ("--set", "sweep.holdout_every=0", "--set", "sweep.backward_every=0")
    stops = () if "--resume" in more else ("--at-mm", "400,500,650,900,1200", "--samples", "1")
    words = ("sweep", "sim", *more, *as_options(), *plan, *stops, "--db", database)
    return run_signalled(number, point, *words, fault=fault)


def assert_one_line(ended: Ended, says: str) -> None:
    assert ended.code == 130, ended.err
    assert "Traceback" not in ended.err
    assert "ignored" not in ended.err
    assert ended.lines == [says]


def assert_free(store: Store, sweep_id: int = 1) -> None:
    assert store.owners() == {}
    assert not (store.sweep(sweep_id).folder / LOCK_FILE).exists()


@pytest.mark.parametrize("number", ALL)
def test_a_signal_while_a_connection_closes_is_one_line(number: int, database: str):
    """SQLAlchemy logs what ends the closing, with its traceback, and passes it on."""
    open_store(database).close()
    ended = run_signalled(number, SHUT, "history", "--db", database)
    assert_one_line(ended, KEPT)


@pytest.mark.parametrize("number", ALL)
def test_a_signal_in_the_first_second_is_one_line(number: int, database: str):
    open_store(database).close()
    ended = run_signalled(number, "import:sqlalchemy", "history", "--db", database)
    assert_one_line(ended, KEPT)
    assert ended.out == ""


@pytest.mark.parametrize("module", ["typer", "rig.cli.history", "numpy", "rig.cli.output"])
def test_a_signal_while_modules_are_read_is_one_line(module: str, database: str):
    open_store(database).close()
    ended = run_signalled(signal.SIGINT, f"import:{module}", "history", "--db", database)
    assert_one_line(ended, KEPT)


@pytest.mark.slow
def test_a_signal_after_the_last_word_leaves_it_whole(database: str):
    open_store(database).close()
    ended = run_signalled(signal.SIGTERM, LAST, "history", "--db", database)
    assert_one_line(ended, KEPT)
    assert "no sweep yet" in ended.out


@slow
def test_before_the_stage_is_open_nothing_was_taken(database: str):
    ended = sweep_with(signal.SIGHUP, OPEN, database)
    assert_one_line(ended, KEPT)
    with open_store(database) as store:
        assert store.sweeps() == ()


@slow
@pytest.mark.parametrize("number", ALL)
def test_while_homing_the_stage_is_stopped(number: int, database: str):
    ended = sweep_with(number, HOME, database)
    assert_one_line(ended, "rig: interrupted; nothing was taken yet, the stage stands still")
    assert ended.out == f"{STILL}\n"


@slow
def test_while_moving_the_stage_is_stopped_and_the_sweep_goes_on(database: str):
    ended = sweep_with(signal.SIGINT, f"{MOVE}:9", database)
    assert_one_line(
        ended,
        "rig: interrupted; sweep 1 ended early, the stage stands still; every sample taken is "
        "stored, go on with: rig sweep sim --resume 1",
    )
    assert ended.out == f"{STILL}\n"
    with open_store(database) as store:
        assert store.sweep(1).state == "taking"
        assert store.sweep(1).ended_at is not None
        assert_free(store)


@slow
def test_in_a_sample_it_is_finished_and_stored(database: str):
    ended = sweep_with(signal.SIGINT, f"{GRAB}:2", database)
    assert ended.code == 130
    assert ended.out == f"{STILL}\n"
    with open_store(database) as store:
        assert [sample.stop.index for sample in store.samples(1)] == [0, 1]
        assert_free(store)


@slow
def test_whatever_stopping_raises_is_said(database: str):
    ended = sweep_with(signal.SIGTERM, f"{GRAB}:2", database, fault="stop")
    assert_one_line(
        ended,
        "rig: interrupted; sweep 1 ended early, the stage may still move, it could not be stopped "
        "(KeyError: 'no such\\nregister'); cut its power; every sample taken is stored, go on "
        "with: rig sweep sim --resume 1",
    )
    with open_store(database) as store:
        assert len(store.samples(1)) == 2
        assert_free(store)


@slow
def test_while_concluding_every_sample_is_stored_and_it_is_concluded_without_devices(
    rig: Command, database: str
):
    ended = sweep_with(signal.SIGTERM, CONCLUDE, database)
    assert_one_line(
        ended,
        "rig: interrupted; every sample of sweep 1 is stored; conclude it: "
        "rig sweep sim --resume 1",
    )
    with open_store(database) as store:
        assert (store.sweep(1).state, store.sweeps()[0].curve_id) == ("taken", None)
        assert_free(store)
    nowhere = ("--set", "stage.port=/dev/no-such-port", "--set", "world.renderer=analytic")
    concluded = rig("sweep", "sim", "--resume", *nowhere, "--db", database, "--json")
    assert concluded.code == 3, concluded.err  # no held-out distances were asked for
    assert "has all its samples; no device is needed" in concluded.err
    assert len(concluded.json["points"]) == 5
    with open_store(database) as store:
        row = store.sweeps()[0]
        assert (row.state, row.curve_id) == ("concluded", 1)
        assert_free(store)
    again = rig("sweep", "sim", "--resume", "1", "--db", database)
    assert again.code == 1
    assert "it is concluded; begin a new one; rig report 1 writes its report again" in again.err


@slow
def test_while_the_report_is_written_the_curve_is_stored(rig: Command, database: str):
    ended = sweep_with(signal.SIGINT, WRITE, database)
    assert_one_line(
        ended, "rig: interrupted; sweep 1 and its curve are stored; its page: rig report 1"
    )
    with open_store(database) as store:
        assert store.sweep(1).state == "concluded"
    assert rig("report", 1, "--db", database).code == 0


@slow
def test_while_devices_are_closed_the_curve_is_still_to_come(database: str):
    ended = sweep_with(signal.SIGINT, CLOSE, database)
    assert ended.code == 130
    assert len(ended.lines) == 1
    with open_store(database) as store:
        assert store.sweep(1).state == "concluded"


@slow
def test_while_fitting_the_samples_are_as_they_were(database: str):
    with open_store(database) as store:
        sweep_id = new_sweep(store, samples_per_stop=1)
        for stop in STOPS:
            store.add_sample(
                sweep_id, stop=stop.index, number=0, reached_mm=1.0, multiview=noisy_multiview(0)
            )
    point = "call:rig.sweep.measure_again:measure_again"
    ended = run_signalled(signal.SIGHUP, point, "fit", "1", "--db", database)
    assert_one_line(ended, "rig: interrupted; the samples of sweep 1 are as they were: rig fit 1")
    with open_store(database) as store:
        assert store.sweep(1).state == "taken"
        assert_free(store)


@slow
@pytest.mark.parametrize(
    ("nth", "says"),
    [
        (1, "no picture was taken yet"),
        (5, "2 pictures are kept; go on with: rig calibrate sim --resume"),
    ],
)
def test_pictures_of_a_calibration_are_kept(nth: int, says: str, database: str, tmp_path: Path):
    quick = ("--set", "world.hand.hold_s=0.7", "--set", "world.hand.move_s=0.05")
    words = ("calibrate", "sim", *as_options(), *quick, "--db", database)
    ended = run_signalled(signal.SIGTERM, f"{GRAB}:{nth}", *words)
    assert ended.code == 130, ended.err
    assert "Traceback" not in ended.err
    albums = list((tmp_path / "frames" / "sim").glob("calibration_*"))
    kept = len(list(tmp_path.glob("frames/sim/calibration_*/picture_*")))
    assert len(albums) == (1 if kept else 0), "an empty album would be taken for the newest"
    if kept:
        says = f"{kept} pictures are kept; go on with: rig calibrate sim --resume"
        assert not (albums[0] / LOCK_FILE).exists()
    assert ended.lines == [f"rig: interrupted; {says}"]
    with open_store(database) as store:
        assert store.owners() == {}


@slow
@pytest.mark.parametrize("point", [OPEN, HOME, f"{MOVE}:3", GRAB])
def test_a_check_that_is_interrupted_leaves_the_stage_stopped(point: str, database: str):
    ended = run_signalled(signal.SIGINT, point, "check", "sim", *as_options(), "--db", database)
    assert_one_line(ended, KEPT)
    assert ended.out.splitlines()[-1] == STILL
