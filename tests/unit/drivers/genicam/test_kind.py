"""What rig knows of GenICam cameras: their search, and how a new profile begins."""

import tomllib
from collections.abc import Sequence
from importlib.metadata import entry_points

import pytest
from rig_genicam import aravis, aravis_library, kind
from rig_genicam.config import GenicamCameraConfig
from rig_genicam.door import Offer

from rig.errors import DeviceNotFoundError
from rig.profile.kinds import CONTRACT, NewCamera


def new_of(*devices: str) -> dict[str, object]:
    assert kind.GENICAM.template is not None
    text = kind.GENICAM.template.section(NewCamera(("left", "right"), devices, 1280, 800))
    return tomllib.loads(text)["camera"]


def test_a_new_profile_names_the_cameras_that_are_there():
    camera = new_of("P1", "P2", "P3")
    config = GenicamCameraConfig.model_validate(camera)
    assert config.devices == {"left": "P1", "right": "P2"}
    assert config.trigger is not None
    assert config.trigger.is_software


def test_a_new_profile_without_cameras_says_what_to_fill_in():
    assert new_of("P1")["devices"] == {
        "left": "P1",
        "right": "REPLACE-BY-THE-SERIAL-NUMBER-OF-right",
    }


def found_with(monkeypatch: pytest.MonkeyPatch, offers: Sequence[Offer]):
    monkeypatch.setattr(aravis, "load_aravis", lambda: None)
    monkeypatch.setattr(aravis_library.AravisLibrary, "offers", lambda _: offers)
    assert kind.GENICAM.search is not None
    return kind.GENICAM.search.find(1.0)


def test_a_serial_number_is_the_best_name_where_it_is_the_only_one(monkeypatch: pytest.MonkeyPatch):
    offers = [
        Offer("77", "Acme-77", "Acme", "Eye 5", "10.0.0.7", "GigEVision"),
        Offer("78", "Acme-78", "Acme", "Eye 5", "", "USB3Vision"),
        Offer("78", "Other-78", "Other", "Look", "", "USB3Vision"),
        Offer("", "Bare", "", "Bare", "", "USB3Vision"),
    ]
    one, two, three, bare = found_with(monkeypatch, offers)
    assert (one.name, one.other_names) == ("77", ("Acme-77", "10.0.0.7"))
    assert one.description == "Acme Eye 5; GigEVision"
    assert (two.name, three.name, bare.name) == ("Acme-78", "Other-78", "Bare")


def test_without_the_library_it_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(aravis, "SONAME", "libaravis-none.so.0")
    aravis.load_aravis.cache_clear()
    try:
        with pytest.raises(DeviceNotFoundError, match=r"apt install libaravis-0\.8-0") as told:
            kind.GENICAM.search.find(1.0)  # pyright: ignore[reportOptionalMemberAccess]
    finally:
        aravis.load_aravis.cache_clear()
    assert "libaravis-none" in told.value.found


def test_it_is_made_for_this_contract_and_plugs_in_from_outside():
    assert kind.GENICAM.contract == CONTRACT
    assert all(entry.value.startswith("rig_genicam.") for entry in entry_points(name="genicam"))
