"""A capture with a camera that moves: what it needs, and where its takes are kept."""

from rig.capture.capture import CaptureRequest
from rig.database import Store
from rig.errors import OptionError
from rig.profile import Profile
from rig.profile.kinds import ScanKeeping


def require_scan(profile: Profile, request: CaptureRequest) -> None:
    """Refuse what a camera that moves cannot do, and what only such a one can.

    Raises:
        OptionError: a scan without an end, or something else than a scan that is to be resumed.
    """
    if not profile.camera.is_scan:
        if request.resume:
            raise OptionError(
                f"--resume: the camera of {profile.name} ({profile.camera.kind}) stands still, "
                "its multi-views have no parts that could be missing",
                advice="leave it out",
            )
        return
    if not request.ends:
        raise OptionError(
            f"asked for a capture of {profile.name} without an end, its camera moves for every "
            "light field",
            advice="say how many: --frames 1",
        )


def scans_of(store: Store, profile: Profile, request: CaptureRequest) -> ScanKeeping | None:
    """Return where the takes of a rig are kept, beside its frames; None where none moves."""
    if not profile.camera.is_scan:
        return None
    folder = store.frames.parent / "scans" / profile.name
    return ScanKeeping(folder, resume=request.resume, file_mode=store.modes.file)
