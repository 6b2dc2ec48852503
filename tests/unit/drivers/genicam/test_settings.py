"""The profile's camera as features of one device, in order and read back."""

from typing import Any

import pytest
from pydantic import ValidationError
from rig_genicam.config import GenicamCameraConfig
from rig_genicam.settings import Applied, apply
from rig_sim.clock import VirtualClock

from rig.errors import ConfigError, ControlError
from tests.support.genicam_device import MemoryDevice


def config_of(**more: Any) -> GenicamCameraConfig:
    return GenicamCameraConfig.model_validate(
        {
            **{"kind": "genicam", "devices": {"a": "M1", "b": "M2"}, "rate_hz": 20.0},
            **{"width_px": 32, "height_px": 16, **more},
        }
    )


def set_up(device: MemoryDevice | None = None, **more: Any) -> tuple[MemoryDevice, Applied]:
    device = device or MemoryDevice(VirtualClock())
    return device, apply(device, config_of(**more), "a")


def test_everything_is_set_in_the_order_in_which_it_depends():
    device, applied = set_up(exposure_s=0.008, gain=6.0, offset_x_px=16, offset_y_px=2)
    assert device.writes == [
        ("TriggerSelector", "FrameStart"),
        ("TriggerMode", "Off"),
        ("TriggerSelector", "AcquisitionStart"),
        ("TriggerMode", "Off"),
        ("PixelFormat", "Mono8"),
        ("OffsetX", 0),
        ("OffsetY", 0),
        ("Width", 32),
        ("Height", 16),
        ("OffsetX", 16),
        ("OffsetY", 2),
        ("ExposureAuto", "Off"),
        ("ExposureTime", 8000.0),
        ("GainAuto", "Off"),
        ("Gain", 6.0),
        ("AcquisitionFrameRateEnable", True),
        ("AcquisitionFrameRate", 20.0),
    ]
    assert applied == Applied(0.008, has_rate=True)


def test_an_input_triggers_as_the_profile_says_and_takes_no_rate():
    trigger = {"source": "Line1", "activation": "RisingEdge"}
    device, applied = set_up(trigger=trigger)
    assert device.writes[-4:] == [
        ("TriggerSelector", "FrameStart"),
        ("TriggerSource", "Line1"),
        ("TriggerActivation", "RisingEdge"),
        ("TriggerMode", "On"),
    ]
    assert "AcquisitionFrameRate" not in dict(device.writes)
    assert applied.has_rate


def test_what_is_not_asked_for_is_left_alone():
    device, applied = set_up()
    assert device.features["ExposureAuto"] == "Continuous"
    assert device.features["GainAuto"] == "Continuous"
    assert applied.exposure_s is None


def test_an_exposure_that_stands_still_is_known():
    device = MemoryDevice(VirtualClock())
    device.features["ExposureAuto"] = "Off"
    assert set_up(device)[1].exposure_s == 0.01


def test_names_from_before_the_convention_are_known():
    device = MemoryDevice(VirtualClock())
    for new, old in [("ExposureTime", "ExposureTimeAbs"), ("Gain", "GainRaw"),
                     ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")]:  # fmt: skip
        device.features[old] = device.features.pop(new)
    set_up(device, exposure_s=0.002, gain=3.0)
    assert device.features["ExposureTimeAbs"] == 2000.0
    assert device.features["AcquisitionFrameRateAbs"] == 20.0
    assert ("GainRaw", 3) in device.writes
    assert type(device.features["GainRaw"]) is int


def test_a_camera_without_a_rate_is_watched():
    device = MemoryDevice(VirtualClock())
    del device.features["AcquisitionFrameRate"]
    assert not set_up(device)[1].has_rate


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"exposure_s": 0.2}, r"ExposureTime 200000 us, it takes 20 to 100000 us; set camera\.exp"),
        ({"gain": 24.5}, r"Gain 24\.5, it takes 0 to 24; set camera\.gain"),
        ({"rate_hz": 201.0}, r"AcquisitionFrameRate 201, it takes 1 to 200; set camera\.rate_hz"),
        ({"width_px": 648}, r"Width 648, it takes 16 to 640; set camera\.width_px"),
        ({"width_px": 36}, r"Width 36, it goes in steps of 8 from 16; the nearest is 32"),
        ({"pixel_format": "Mono16"}, r"PixelFormat Mono16, offers Mono8, Mono12p; set camera\.pix"),
        ({"trigger": {"source": "Line9"}}, r"TriggerSource Line9, offers Line1, Software"),
        ({"features": {"Warp": 9}}, r"asked for camera\.features\.Warp, has no Warp now"),
        ({"features": {"Gain": "high"}}, r"asked for Gain 'high', it is a number"),
        ({"view_features": {"a": {"Gain": -1}}}, r"set camera\.view_features\.a\.Gain"),
    ],
)
def test_what_a_camera_does_not_offer_is_told_with_what_it_does(more: dict[str, Any], told: str):
    with pytest.raises(ConfigError, match=told):
        set_up(**more)


@pytest.mark.parametrize(("key", "feature"), [("exposure_s", "ExposureTime"), ("gain", "Gain")])
def test_a_camera_without_the_feature_is_told_its_key(key: str, feature: str):
    device = MemoryDevice(VirtualClock())
    del device.features[feature]
    with pytest.raises(ConfigError, match=rf"asked for camera\.{key}, has no {feature} or "):
        set_up(device, **{key: 0.01})


def test_software_triggers_need_their_command():
    device = MemoryDevice(VirtualClock(), commands=set())
    with pytest.raises(ConfigError, match="has no TriggerSoftware now"):
        set_up(device, trigger={"source": "Software"})


@pytest.mark.parametrize(
    ("applied_us", "is_taken"), [(8079.0, True), (7921.0, True), (8090.0, False), (7900.0, False)]
)
def test_a_sensor_may_round_by_one_percent(applied_us: float, is_taken: bool):
    device = MemoryDevice(VirtualClock(), stored={"ExposureTime": lambda _: applied_us})
    if is_taken:
        assert set_up(device, exposure_s=0.008)[1].exposure_s == pytest.approx(1e-6 * applied_us)
    else:
        told = (
            rf"ExposureTime 8000\.0, the camera applies {applied_us}; ask for that by camera\.exp"
        )
        with pytest.raises(ControlError, match=told):
            set_up(device, exposure_s=0.008)
    assert device.features["ExposureTime"] == applied_us


def test_a_width_may_not_be_rounded():
    device = MemoryDevice(VirtualClock(), stored={"Width": lambda _: 33})
    with pytest.raises(ControlError, match="asked for Width 32, the camera applies 33"):
        set_up(device)


def test_a_camera_that_refuses_is_told_with_its_own_words():
    device = MemoryDevice(VirtualClock(), refused={"PixelFormat": "locked while it streams"})
    with pytest.raises(ControlError, match=r"applies nothing \(locked while it streams\)"):
        set_up(device)


def test_a_command_is_executed_and_its_refusal_told():
    device = MemoryDevice(VirtualClock(), commands={"Reset"})
    set_up(device, features={"Reset": True})
    assert ("Reset", True) in device.writes
    device.refused["Reset"] = "not now"
    with pytest.raises(ControlError, match=r"Reset to be executed, .* nothing \(not now\)"):
        set_up(device, features={"Reset": True})


def test_a_views_own_features_come_after_those_of_all():
    device, _ = set_up(features={"Gain": 1.0, "OffsetX": 8}, view_features={"a": {"Gain": 2.0}})
    assert device.writes[-2:] == [("Gain", 2.0), ("OffsetX", 8)]


CHUNKS = ("ChunkModeActive", "ChunkSelector", "ChunkEnable")


def with_chunks() -> MemoryDevice:
    device = MemoryDevice(VirtualClock())
    device.features |= {"ChunkModeActive": False, "ChunkSelector": "Gain", "ChunkEnable": False}
    device.lists["ChunkSelector"] = ("Gain", "ExposureTime", "Timestamp")
    return device


def test_chunks_that_are_offered_are_asked_for():
    device, _ = set_up(with_chunks())
    assert [write for write in device.writes if write[0] in CHUNKS] == [
        ("ChunkModeActive", True),
        ("ChunkSelector", "Timestamp"),
        ("ChunkEnable", True),
        ("ChunkSelector", "ExposureTime"),
        ("ChunkEnable", True),
    ]


def test_chunks_can_be_switched_off():
    device, _ = set_up(with_chunks(), features={"ChunkModeActive": False})
    assert [write for write in device.writes if write[0] in CHUNKS] == [("ChunkModeActive", False)]


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"devices": {"a": "M1", "b": "M1"}}, "one camera for two views: M1"),
        ({"view_features": {"c": {}}}, "view_features names no view: c"),
        ({"pixel_format": "YUV422"}, "pixel_format"),
        ({"trigger": {"source": "Software", "rate": 3}}, "trigger.rate"),
        ({"exposure_s": 0.0}, "exposure_s"),
    ],
)
def test_a_profile_that_cannot_be_is_refused(more: dict[str, Any], told: str):
    with pytest.raises(ValidationError, match=told):
        config_of(**more)
