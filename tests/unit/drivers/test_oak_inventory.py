"""OAK devices as DepthAI and as the kernel see them."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.oak.answer import Answer, parse_answer
from rig_drivers.oak.inventory import joined, list_oaks
from rig_drivers.usb import MOVIDIUS, UsbDevice, usb_devices

from rig.errors import ConfigError, DeviceNotFoundError

ON_USB = UsbDevice("1-4", MOVIDIUS, "2485", "Movidius MyriadX", "03e72485", Path("/dev/null"))
ANSWER = Answer(device_id="184430", name="1-4", protocol="usb", problem=None)


def test_one_device_seen_by_both_is_listed_once():
    (oak,) = joined([ANSWER], [ON_USB])
    assert (oak.name, oak.other_names, oak.problem) == ("184430", ("1-4",), None)


def test_a_device_that_only_the_kernel_sees_is_told_with_what_to_do():
    (busy,) = joined([], [ON_USB])
    assert busy.name == "1-4"
    assert busy.problem is not None
    assert "another program" in busy.problem
    missing = UsbDevice("1-5", MOVIDIUS, "2485", "", "", Path("/does/not/exist"))
    (locked,) = joined([], [missing])
    assert locked.problem is not None
    assert "udev" in locked.problem


def test_the_last_line_of_the_answer_counts():
    assert parse_answer(f"[depthai] noise\n[{ANSWER.model_dump_json()}]\n", 0) == [ANSWER]


@pytest.mark.parametrize("text", ["", "nothing\n", "{}\n", '"words"\n'])
def test_an_answer_that_is_none_is_an_error(text: str):
    with pytest.raises(DeviceNotFoundError, match="code 134"):
        parse_answer(text, 134)


def test_a_missing_extra_and_a_failed_search_are_two_things():
    with pytest.raises(ConfigError, match="pip"):
        parse_answer('{"found": "not there", "advice": "pip install it", "installed": false}', 0)
    with pytest.raises(DeviceNotFoundError, match="failed"):
        parse_answer('{"found": "the search failed", "advice": "", "installed": true}', 0)


def test_a_search_that_takes_too_long_is_ended():
    with pytest.raises(DeviceNotFoundError, match="--timeout-s"):
        list_oaks(0.01)


def test_usb_devices_are_those_of_the_kernel(tmp_path: Path):
    for place, vendor in (("1-4", MOVIDIUS), ("usb1", "1d6b"), ("1-4:1.0", "")):
        folder = tmp_path / place
        folder.mkdir()
        files = {"idVendor": vendor, "idProduct": "2485", "busnum": "1", "devnum": "7"}
        for name, text in {**files, "product": "Movidius", "serial": "03e7"}.items():
            if vendor:
                (folder / name).write_text(text + "\n")
    found = usb_devices(tmp_path)
    assert [device.place for device in found] == ["1-4", "usb1"]
    assert found[0].node == Path("/dev/bus/usb/001/007")
    assert usb_devices(tmp_path / "nowhere") == ()


@given(text=st.text() | st.binary().map(lambda data: data.decode("latin-1")))
def test_any_answer_is_a_list_or_an_error_of_ours(text: str):
    try:
        answer = parse_answer(text, 1)
    except (ConfigError, DeviceNotFoundError) as error:
        assert str(error)
    else:
        assert isinstance(answer, list)


@pytest.mark.slow
@given(
    answer=st.recursive(
        st.none() | st.booleans() | st.integers() | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    )
)
def test_any_json_is_a_list_of_devices_or_an_error_of_ours(answer: object):
    try:
        listed = joined(parse_answer(json.dumps(answer), 1), [ON_USB])
    except (ConfigError, DeviceNotFoundError) as error:
        assert str(error)
    else:
        assert [oak.name for oak in listed] == [ON_USB.place]
