"""Controls as they are written into a message, and compared with what a frame reports."""

from dataclasses import replace

import pytest
from rig_drivers.oak.controls import Applied, Controls
from rig_drivers.oak.sdk import dai

from rig.errors import ControlError
from tests.support.oak import oak_config

LOCKED = Controls(exposure_s=0.008, iso=200, lens_position=120, white_balance_k=4000)
GOOD = Applied(exposure_s=0.008, iso=200, lens_position=120, white_balance_k=4000)


def test_every_automatic_is_switched_off():
    control = dai.CameraControl()
    LOCKED.set_on(control)
    command = dai.CameraControl.Command
    assert control.expManual.exposureTimeUs == 8000
    assert control.expManual.sensitivityIso == 200
    assert control.lensPosition == 120
    assert control.wbColorTemp == 4000
    assert control.autoFocusMode == dai.CameraControl.AutoFocusMode.OFF
    for wanted in (command.AE_MANUAL, command.MOVE_LENS, command.WB_COLOR_TEMP):
        assert control.getCommand(wanted)
    for filtered in (command.SHARPNESS, command.LUMA_DENOISE, command.CHROMA_DENOISE):
        assert control.getCommand(filtered)
    assert (control.sharpness, control.lumaDenoise, control.chromaDenoise) == (0, 0, 0)


def test_what_a_sensor_does_not_have_is_left_alone():
    control = dai.CameraControl()
    Controls.of(oak_config()).set_on(control)
    assert not control.getCommand(dai.CameraControl.Command.MOVE_LENS)
    assert not control.getCommand(dai.CameraControl.Command.WB_COLOR_TEMP)


def test_the_steps_of_a_sensor_are_no_difference():
    LOCKED.require(replace(GOOD, exposure_s=0.00803, iso=206), "camera")
    for within, beyond in (
        (replace(GOOD, exposure_s=0.00815), replace(GOOD, exposure_s=0.00817)),
        (replace(GOOD, iso=192), replace(GOOD, iso=191)),
        (replace(GOOD, white_balance_k=4100), replace(GOOD, white_balance_k=4101)),
    ):
        LOCKED.require(within, "camera")
        with pytest.raises(ControlError):
            LOCKED.require(beyond, "camera")


def test_at_low_gain_one_sixteenth_is_no_difference():
    at_100 = replace(LOCKED, iso=100)
    at_100.require(replace(GOOD, iso=107), "camera")
    with pytest.raises(ControlError, match="iso 100, the camera applies 108"):
        at_100.require(replace(GOOD, iso=108), "camera")


def test_a_value_that_the_profile_leaves_open_may_be_any():
    Controls.of(oak_config()).require(replace(GOOD, iso=106, lens_position=-1), "camera")


@pytest.mark.parametrize(
    ("applied", "says"),
    [
        (replace(GOOD, exposure_s=0.004), "exposure_s 0.008000 s, the camera applies 0.004000 s"),
        (replace(GOOD, exposure_s=0.0), "applies nothing; it does not report this value"),
        (replace(GOOD, iso=100), "iso 200, the camera applies 100"),
        (replace(GOOD, lens_position=121), "lens_position 120, the camera applies 121"),
        (replace(GOOD, white_balance_k=5000), "white_balance_k 4000 K, the camera applies 5000 K"),
    ],
)
def test_another_value_is_an_error_that_names_both(applied: Applied, says: str):
    with pytest.raises(ControlError, match="OAK 1, view left") as caught:
        LOCKED.require(applied, "OAK 1, view left")
    assert says in str(caught.value)
    assert f"set camera.{caught.value.control}" in str(caught.value)
