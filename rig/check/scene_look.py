"""One look at an ordinary scene: take it, compare it with the calibration, keep the answer."""

from collections.abc import Generator

from rig.check.items import Item, failed
from rig.check.scene_drift import drift_details, drift_since, judge_scene_drift
from rig.database import Store, open_store
from rig.devices import Camera, Clock
from rig.errors import RigError
from rig.frames import MultiView
from rig.hardware.opening import open_camera
from rig.profile import Profile
from rig.records import StoredCalibration
from rig.stored import LENSLETS, RunChoice, open_run
from rig.unit import unit_of

_LOOKS, _EVERY_S = 6, 1.0
"""Multi-views of the scene, within some five seconds."""


def check_scene(profile: Profile, choice: RunChoice) -> Generator[Item]:
    """Look at whatever is before the cameras, compare it with the calibration, and keep the answer.

    Args:
        profile: the rig.
        choice: which calibration.

    Raises:
        ConfigError: the calibration does not fit the rig.
        StoreError: there is no such calibration as was asked for.
    """
    with open_store(choice.database, absent="empty") as store:
        run = open_run(store, profile, choice.calibration, "none")
        stored = run.calibration
        if stored is None or LENSLETS in stored.geometry:
            found = "nothing to compare with: this rig has no stored geometric calibration"
            yield Item("scene", "skip", found, f"rig calibrate {profile.name}")
            return
        try:
            with open_camera(profile) as (camera, clock):
                yield _look(profile, stored, store, camera, clock)
        except RigError as error:
            yield failed("scene", error)


def _look(
    profile: Profile, stored: StoredCalibration, store: Store, camera: Camera, clock: Clock
) -> Item:
    multiviews = list(_looks(profile, camera, clock))
    full_scale = multiviews[0].frames[0].full_scale
    drift = drift_since(stored, profile, [one.images for one in multiviews], full_scale)
    temperature_degc = multiviews[-1].temperature_degc
    store.save_drift(
        stored.id,
        rig=profile.name,
        details=drift_details(drift, profile),
        temperature_degc=temperature_degc,
        unit=unit_of(profile, camera.identity),
    )
    return judge_scene_drift(drift, profile, stored, temperature_degc)


def _looks(profile: Profile, camera: Camera, clock: Clock) -> Generator[MultiView]:
    """Some multi-views of one scene; of a stored camera one, the next may show another."""
    for number in range(1 if profile.camera.is_stored else _LOOKS):
        if number:
            clock.sleep_s(_EVERY_S)
        yield camera.grab(profile.camera.timeout_s)
