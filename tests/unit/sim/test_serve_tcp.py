"""The simulated stage on a TCP port: our drivers, the vendor's client and the verb reach it."""

import json
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager

import pytest
from rig_drivers.zaber.controller import zaber_stage
from rig_sim.bench import plugged_world, serve_stage
from rig_sim.carriage import Carriage
from rig_sim.firmware.zaber import ZaberFirmware
from rig_sim.wire.serve_tcp import serve_on_tcp

from rig.devices import SystemClock
from rig.errors import ConfigError
from rig.profile import CarriageConfig, FirmwareConfig
from rig.profile.load import load_profile
from tests.support.stages import ZABER

FAST = FirmwareConfig(
    boot_s=0.02,
    travel_mm=120.0,
    max_rate_mm_s=500.0,
    acceleration_mm_s2=5000.0,
    homing_mm_s=200.0,
    homing_locate_mm_s=50.0,
)
HURRY = [
    "world.firmware.max_rate_mm_s=900",
    "world.firmware.acceleration_mm_s2=9000",
    "world.firmware.homing_mm_s=900",
    "world.firmware.boot_s=0.05",
]


class Interrupted(ZaberFirmware):
    """A chain in whose service somebody presses Ctrl-C."""

    is_enough = False

    def next_event_s(self) -> float | None:
        if self.is_enough:
            raise KeyboardInterrupt
        return super().next_event_s()


def test_the_driver_reaches_it_over_tcp_in_real_time() -> None:
    clock = SystemClock()
    carriage = Carriage(CarriageConfig(board_at_machine_zero_mm=210.0, power_up_mm=-3.0), clock)
    firmware = Interrupted(FAST, carriage, clock)
    ready: queue.Queue[str] = queue.Queue()

    def serve() -> None:
        with pytest.raises(KeyboardInterrupt):
            serve_on_tcp(firmware, 0, on_ready=ready.put)

    server = threading.Thread(target=serve)
    server.start()
    config = ZABER.model_copy(update={"port": ready.get(timeout=5.0), "speed_mm_s": 500.0})
    with zaber_stage(config, clock) as stage:
        stage.home()
    with zaber_stage(config, clock) as stage:
        assert stage.move_to(190.0, 5.0) == pytest.approx(190.0)
        assert carriage.travelled_mm(clock.now_s()) == pytest.approx(-20.0, abs=0.01)
        firmware.is_enough = True
        server.join(5.0)
    assert not server.is_alive()


def test_a_port_in_use_is_told() -> None:
    def start_another(url: str) -> None:
        taken = int(url.rpartition(":")[2])
        with pytest.raises(ConfigError, match=f"TCP port {taken} cannot be opened"):
            serve_stage(load_profile("sim"), "zaber", lambda _: None, tcp_port=taken)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        serve_stage(load_profile("sim"), "marlin", start_another, tcp_port=0)


@pytest.mark.parametrize(("port", "is_real"), [("sim://grbl", False), ("/dev/ttyUSB0", True)])
def test_a_stage_at_a_true_port_lives_in_true_time(port: str, is_real: bool) -> None:
    profile = load_profile("sim", [f"stage.port={port}", "world.renderer=analytic"])
    with plugged_world(profile, uses_stage=True) as world:
        assert isinstance(world.clock, SystemClock) is is_real
    with plugged_world(profile, uses_stage=False) as world:
        assert not isinstance(world.clock, SystemClock)


@contextmanager
def the_verb(*options: str, overrides: Sequence[str] = HURRY) -> Generator[str]:
    """Run `rig sim stage` on a TCP port; ends as Ctrl-C does."""
    sets = [word for override in overrides for word in ("--set", override)]
    command = [sys.executable, "-c", "from rig.cli import main; main()", "sim", "stage", "--json"]
    with subprocess.Popen(
        [*command, "--tcp", "0", *options, *sets],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdout is not None
        told = json.loads("".join(iter(server.stdout.readline, "}\n")) + "}")
        try:
            yield told["port"]
        finally:
            server.send_signal(signal.SIGINT)
            assert server.wait(10.0) == 130


@pytest.mark.slow
def test_the_vendors_client_and_ours_agree() -> None:
    """The client of the devices' maker finds, homes and moves the simulated chain."""
    ascii_protocol = pytest.importorskip("zaber_motion.ascii")
    errors = pytest.importorskip("zaber_motion")
    chain = ["world.firmware.zaber.addresses=[1, 4]", "world.firmware.zaber.axes=2"]
    with the_verb("--protocol", "zaber", overrides=[*HURRY, *chain]) as url:
        host, _, port = url.removeprefix("socket://").partition(":")
        with ascii_protocol.Connection.open_tcp(host, int(port)) as connection:
            connection.enable_alerts()
            devices = connection.detect_devices(identify_devices=False)
            assert [device.device_address for device in devices] == [1, 4]
            axis = devices[0].get_axis(1)
            assert axis.warnings.get_flags() == {"WR"}
            axis.home()
            assert axis.get_position() == 0
            assert axis.warnings.get_flags() == set()
            axis.move_absolute(20_000)
            axis.move_relative(-1_000)
            assert axis.get_position() == 19_000
            axis.move_absolute(200_000, wait_until_idle=False)
            assert axis.is_busy()
            axis.stop()
            assert not axis.is_busy()
            axis.move_max()
            assert axis.get_position() == 328_000
            assert axis.settings.get("limit.max") == 328_000
            with pytest.raises(errors.exceptions.BadDataException):
                axis.move_absolute(10_000_000)
            with pytest.raises(errors.exceptions.BadCommandException):
                axis.generic_command("sing")
            other = devices[1].get_axis(2)
            other.home()
            other.move_absolute(5_000)
            assert (other.get_position(), axis.get_position()) == (5_000, 328_000)
            axis.driver_disable()
            with pytest.raises(errors.exceptions.DriverDisabledException):
                axis.move_absolute(100)
            axis.driver_enable()
            axis.home()
            axis.move_absolute(20_000)
        ours = ZABER.model_copy(
            update={
                "port": url,
                "travel_mm": (400.0, 1200.0),
                "distance_at_machine_zero_mm": 1203.0,
            }
        )
        with zaber_stage(ours, SystemClock()) as stage:
            assert stage.position_mm == pytest.approx(1203.0 - 50.0)
