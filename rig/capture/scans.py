"""A capture with a camera that moves: what it needs, and where its takes are kept."""

from collections.abc import Generator
from contextlib import contextmanager

from rig.capture.capture import CaptureRequest
from rig.database import Store
from rig.errors import OptionError, StoreError
from rig.files import make_folder
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


@contextmanager
def owned_scans(store: Store, rig: str, scans: ScanKeeping | None) -> Generator[None]:
    """Be the only program that scans with a rig, from here to the end of the block.

    Two of them would drive one slider. The lease is a row of the database, as that of a sweep is,
    so that programs on other machines see it too.

    Args:
        store: of the takes.
        rig: its name.
        scans: where takes are kept; None for a camera that stands, which needs no lease.

    Raises:
        OwnedError: another program scans with it; names that one.
        StoreError: the folder of the takes cannot be made, or database or folder may only be read.
    """
    if scans is None:
        yield
        return
    try:
        make_folder(scans.folder, store.modes.folder)
    except OSError as error:
        raise StoreError(
            f"{scans.folder}: takes of a scan cannot be kept there: {error.strerror}",
            advice="make room, or choose another database with --db",
        ) from error
    with store.owned(f"scan {rig}", scans.folder, f"asked to scan with {rig}"):
        yield
