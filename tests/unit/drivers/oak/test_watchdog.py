"""Who is silent, and who is out of step."""

import pytest
from rig_drivers.oak.watchdog import Watchdog


def saw(watchdog: Watchdog, view: str, middle_s: float) -> None:
    watchdog.saw(view, start_s=middle_s - 0.004, middle_s=middle_s)


def test_a_sensor_is_silent_until_it_began_a_frame_after_the_question():
    watchdog = Watchdog(("left", "right"))
    assert watchdog.silent_since(0.0) == ("left", "right")
    saw(watchdog, "left", 1.0)
    saw(watchdog, "right", 1.0)
    assert watchdog.silent_since(0.9) == ()
    saw(watchdog, "left", 1.1)
    saw(watchdog, "right", 0.8)  # an old frame that comes late is no news
    assert watchdog.silent_since(1.0) == ("right",)


@pytest.mark.parametrize(
    ("left_s", "right_s", "phase_s"),
    [(1.0, 1.0, 0.0), (1.0, 1.1, 0.0), (1.0, 0.9, 0.0), (1.0, 1.103, 0.003), (1.0, 0.795, 0.005)],
)
def test_the_phase_of_two_sensors_does_not_depend_on_who_sent_last(
    left_s: float, right_s: float, phase_s: float
):
    watchdog = Watchdog(("left", "right"))
    assert watchdog.phase_s(0.1) == 0.0
    saw(watchdog, "left", left_s)
    assert watchdog.phase_s(0.1) == 0.0
    saw(watchdog, "right", right_s)
    assert watchdog.phase_s(0.1) == pytest.approx(phase_s, abs=1e-9)
