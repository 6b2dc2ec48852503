"""Which device a profile means, among devices as the library describes them."""

import pytest
from rig_drivers.oak.discovery import choose_oak, find_oak, found_oaks
from rig_drivers.oak.sdk import dai

from rig.errors import DeviceNotFoundError

OK, LOCKED = dai.XLinkError_t.X_LINK_SUCCESS, dai.XLinkError_t.X_LINK_INSUFFICIENT_PERMISSIONS


def device(name: str, device_id: str, status: dai.XLinkError_t = OK) -> dai.DeviceInfo:
    return dai.DeviceInfo(
        name,
        device_id,
        dai.XLinkDeviceState.X_LINK_UNBOOTED,
        dai.XLinkProtocol.X_LINK_USB_VSC,
        dai.XLinkPlatform.X_LINK_MYRIAD_X,
        status,
    )


USB, POE = device("1.2.3", "18443010D1E5A70F00"), device("192.168.1.7", "184430102144CC1200")


def test_a_device_is_found_by_id_by_address_or_because_it_is_the_only_one():
    assert choose_oak("18443010D1E5A70F00", [POE, USB]) is USB
    assert choose_oak("192.168.1.7", [POE, USB]) is POE
    assert choose_oak("", [USB]) is USB


def test_an_address_beyond_the_broadcast_is_tried():
    assert choose_oak("10.0.0.5", [USB]).name == "10.0.0.5"


def test_a_host_name_is_the_address_that_it_stands_for():
    assert choose_oak("localhost", [USB]).name == "127.0.0.1"
    local = device("127.0.0.1", "184430102144CC1200")
    assert choose_oak("localhost", [USB, local]) is local


def test_a_host_name_that_nobody_knows_is_not_there():
    with pytest.raises(DeviceNotFoundError, match=r"asked for oak\.invalid, found 1844"):
        choose_oak("oak.invalid", [USB])


@pytest.mark.parametrize(
    ("wanted", "there", "says"),
    [
        ("", [], "asked for the only OAK device, found none; check power and cable"),
        ("", [USB, POE], "found 18443010D1E5A70F00 (1.2.3), 184430102144CC1200 (192.168.1.7)"),
        ("184430", [USB], "asked for 184430, found 18443010D1E5A70F00 (1.2.3); correct"),
        (
            "",
            [device("1.2", "1844", LOCKED)],
            "may not be opened; install the rules that",
        ),
    ],
)
def test_what_is_there_is_named_where_nothing_fits(
    wanted: str, there: list[dai.DeviceInfo], says: str
):
    with pytest.raises(DeviceNotFoundError) as caught:
        choose_oak(wanted, there)
    assert says in str(caught.value)


@pytest.mark.slow
def test_a_search_on_this_machine_ends_quickly_and_without_an_exception_of_the_library():
    there = found_oaks()
    if not there:
        with pytest.raises(DeviceNotFoundError, match="found none"):
            find_oak("")
