"""How often a driver asks before it gives up, and what it trusts afterwards."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import count, pairwise

import pytest
from rig_drivers.stage.serial_stage import SerialStage

from rig.errors import DeviceLostError, DeviceNotFoundError, StageAlarmError, StageTimeoutError
from rig.profile import StageConfig
from tests.support.scripted_wire import Scripted, scripted
from tests.support.stages import MARLIN, STAGE, ZABER, simulated_bench


@contextmanager
def homed(config: StageConfig = STAGE) -> Generator[tuple[SerialStage, Scripted]]:
    with simulated_bench(config, before=Scripted) as bench, bench.stage as stage:
        stage.home()
        wire = scripted(bench)
        wire.sent = b""
        try:
            yield stage, wire
        finally:
            wire.on_transmit = wire.on_receive = lambda data: data


def without(begins: bytes) -> Callable[[bytes], bytes]:
    """Take the lines away that begin so."""
    return lambda data: b"".join(
        line for line in data.splitlines(keepends=True) if not line.startswith(begins)
    )


def test_settings_that_are_never_twice_alike_are_read_four_times():
    with simulated_bench(before=Scripted) as bench:
        wire, number = scripted(bench), count()
        wire.on_transmit = lambda data: data.replace(b"$26=50", b"$26=%d" % next(number))
        with pytest.raises(DeviceLostError, match=r"\(\$\$\) 4 times, never twice alike"):
            bench.stage.__enter__()
        assert wire.sent.count(b"$$") == 4


def test_settings_that_agree_are_read_twice():
    with simulated_bench(before=Scripted) as bench, bench.stage:
        assert scripted(bench).sent.count(b"$$") == 2


def test_a_status_is_asked_for_six_times():
    with homed() as (stage, wire):
        wire.on_transmit = without(b"<")
        with pytest.raises(StageTimeoutError, match=r"no status report within 1\.8 s"):
            _ = stage.position_mm
        assert wire.sent == b"??????"


def test_a_controller_that_does_not_come_back_is_reset_three_times():
    with homed() as (stage, wire):
        wire.on_transmit = without(b"")
        with pytest.raises(DeviceLostError, match="did not come back from 3 resets"):
            stage.stop()
        assert wire.sent.count(b"\x18") == 3


def test_after_a_reset_without_a_status_the_position_is_not_trusted():
    with homed() as (stage, wire):
        wire.on_transmit = without(b"<")
        stage.stop()
        wire.on_transmit = lambda data: data
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm


def test_after_a_stop_at_rest_the_position_is_trusted():
    with homed() as (stage, _):
        stage.stop()
        assert stage.position_mm == pytest.approx(208.0)


def test_homing_that_was_refused_leaves_no_position_that_could_be_trusted():
    with homed() as (stage, wire):
        wire.on_receive = lambda data: data.replace(b"$H", b"$Q")
        with pytest.raises(StageAlarmError, match="error:"):
            stage.home()
        wire.on_receive = lambda data: data
        with pytest.raises(StageAlarmError, match="home the stage first"):
            _ = stage.position_mm


def test_a_silent_marlin_is_killed_four_times_and_not_trusted():
    with homed(MARLIN) as (stage, wire):
        wire.on_transmit = without(b"")
        with pytest.raises(DeviceLostError, match=r"did not confirm 4 emergency stops \(M112\)"):
            stage.stop()
        assert wire.sent.count(b"M112") == 4
        assert not stage._controller.is_homed


def test_a_silent_zaber_is_sent_a_stop_and_lost():
    with homed(ZABER) as (stage, wire):
        wire.on_transmit = without(b"")
        with pytest.raises(DeviceLostError):
            stage.stop()
        assert b" stop:" in wire.sent


def test_a_zaber_is_asked_four_times_and_eight_times_while_it_may_be_starting():
    with homed(ZABER) as (stage, wire):
        wire.on_transmit = without(b"")
        with pytest.raises(StageTimeoutError, match=r"`warnings` got no answer within 2\.0 s"):
            _ = stage.position_mm
        assert wire.sent.count(b" warnings:") == 4
    with simulated_bench(ZABER, before=Scripted) as bench:
        wire = scripted(bench)
        wire.on_transmit = without(b"")
        began_s = bench.clock.now_s()
        with pytest.raises(DeviceNotFoundError, match="Zaber device 1, nothing answered"):
            bench.stage.__enter__()
        ascii_part, is_last, nothing = wire.sent.partition(b"\x00\x32\x00\x00\x00\x00")
        assert (bool(is_last), nothing) == (True, b""), "once in the binary protocol, at last"
        lines = [line.rpartition(b":")[0] for line in ascii_part.splitlines()]
        assert lines == [*(b"/1 0 %d" % number for number in range(1, 9)), b"/0 0 --"]
        assert bench.clock.now_s() - began_s == pytest.approx(10 * 0.5 + 0.1, abs=0.3)


def test_commands_of_a_zaber_are_numbered_from_1_to_99_and_0():
    with homed(ZABER) as (stage, wire):
        for _ in range(40):
            _ = stage.position_mm
        words = [line.split() for line in wire.sent.splitlines()]
        numbers = [int(found[2]) for found in words]
        steps = {(b - a) % 100 for a, b in pairwise(numbers)}
        assert steps == {1}
        assert (min(numbers), max(numbers)) == (0, 99)


def test_a_marlin_whose_settings_are_never_twice_alike_is_read_four_times():
    with simulated_bench(MARLIN, before=Scripted) as bench:
        wire, number = scripted(bench), count(1)
        wire.on_transmit = lambda data: data.replace(b"M92 X400.", b"M92 X%d." % next(number))
        with pytest.raises(DeviceLostError, match=r"\(M503, M211\) 4 times, never twice alike"):
            bench.stage.__enter__()
        assert wire.sent.count(b"M503") == 4


def test_a_marlin_whose_coordinate_is_not_its_count_is_read_six_times():
    with homed(MARLIN) as (stage, wire):
        wire.on_transmit = lambda data: data.replace(b"Count X:0 ", b"Count X:9 ")
        with pytest.raises(StageAlarmError, match="6 readings of M114 disagree"):
            _ = stage.position_mm
        assert wire.sent.count(b"M114 R") == 6


def test_a_count_may_differ_from_its_rounded_coordinate_by_half_of_its_last_digit():
    with homed(MARLIN) as (stage, wire):
        here_mm = stage.position_mm
        for steps, off_mm in ((2, 0.005), (-2, -0.005)):
            text = b"Count X:%d " % steps
            wire.on_transmit = lambda data, text=text: data.replace(b"Count X:0 ", text)
            assert stage.position_mm == pytest.approx(here_mm - off_mm, abs=1e-9)


def test_after_an_urgent_stop_a_marlin_is_spoken_to_before_it_is_told_anything():
    with homed(MARLIN) as (stage, wire):
        stage.stop()
        said = [line for line in wire.sent.splitlines() if line]
        bare = [b"M410" if line == b"M410" else line.split()[1].split(b"*")[0] for line in said]
    assert bare == [b"M410", b"M410", b"M118", b"M410", b"M118"]
