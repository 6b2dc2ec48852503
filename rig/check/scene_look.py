"""One look at an ordinary scene: take it, compare it with the calibration, keep the answer."""

from collections.abc import Generator

from rig.check.items import Item, failed
from rig.check.scene_drift import Seen, drift_details, drift_since, judge_scene_drift
from rig.database import Store, open_store
from rig.devices import Camera, Clock
from rig.errors import RigError
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
    seen = list(_looks(profile, camera, clock))
    drift = drift_since(stored, profile, seen)
    temperature_degc = seen[-1].views.temperature_degc
    store.save_drift(
        stored.id,
        rig=profile.name,
        details=drift_details(drift, profile),
        temperature_degc=temperature_degc,
        unit=unit_of(profile, camera.identity),
    )
    return judge_scene_drift(drift, profile, stored, temperature_degc)


def _looks(profile: Profile, camera: Camera, clock: Clock) -> Generator[Seen]:
    """Some multi-views of one scene, each with the one before it.

    Of a stored camera one alone: the next may show another scene.
    """
    timeout_s = profile.camera.timeout_s
    if profile.camera.is_stored:
        yield Seen(camera.grab(timeout_s))
        return
    for number in range(_LOOKS):
        if number:
            clock.sleep_s(_EVERY_S)
        earlier = camera.grab(timeout_s)
        yield Seen(camera.grab(timeout_s), earlier)
