"""Which V4L2 cameras are plugged in, and what a profile calls them."""

from dataclasses import dataclass
from pathlib import Path

from rig.errors import DeviceError, DeviceNotFoundError
from rig_drivers.v4l2.best_mode import best_mode
from rig_drivers.v4l2.controls import Controls
from rig_drivers.v4l2.formats import Mode, size_offers
from rig_drivers.v4l2.kernel import Kernel
from rig_drivers.v4l2.node import Node


@dataclass(frozen=True, slots=True)
class VideoNode:
    """One node of `/dev` that streams pictures, or would if it could be opened."""

    path: Path
    """`/dev/videoN`; N changes from start to start."""
    stable_paths: tuple[Path, ...]
    """Links that name the same camera after the next start; by-path first, then by-id."""
    card: str = ""
    """What the camera calls itself."""
    bus: str = ""
    """Where it is plugged in."""
    pixel_formats: tuple[str, ...] = ()
    largest_px: tuple[int, int] | None = None
    """Width and height of its largest picture, where it lists any."""
    best: Mode | None = None
    """What measures best of what it offers; None where it does not tell sizes and rates."""
    controls: tuple[str, ...] = ()
    trouble: str | None = None
    """Why it could not be asked, and what to do; None if all is well."""

    @property
    def best_path(self) -> Path:
        """The path that a profile should name."""
        return self.stable_paths[0] if self.stable_paths else self.path


def video_nodes(kernel: Kernel, *, root: Path = Path("/dev")) -> list[VideoNode]:
    """Return all nodes that stream pictures to us, in the order of their numbers.

    Nodes that can be opened and are no cameras (metadata, outputs, codecs) are left out; those that
    may not be opened are listed with their trouble. Nothing is set or started.

    Args:
        kernel: the system calls.
        root: where nodes and their links are.
    """
    paths = sorted(root.glob("video[0-9]*"), key=lambda path: (len(path.name), path.name))
    links = [
        link
        for folder in ("by-path", "by-id")
        for link in sorted((root / "v4l" / folder).glob("*"))
    ]
    found = [_described(path, links, kernel) for path in paths]
    return [node for node in found if node is not None]


def _described(path: Path, links: list[Path], kernel: Kernel) -> VideoNode | None:
    stable = tuple(link for link in links if link.resolve() == path.resolve())
    try:
        with Node(path, kernel) as node:
            offers = size_offers(node)
            told = [(o.width_px.most, o.height_px.most) for o in offers if o.is_told]
            return VideoNode(
                path,
                stable,
                card=node.capability.card.decode(errors="replace"),
                bus=node.capability.bus_info.decode(errors="replace"),
                pixel_formats=tuple(dict.fromkeys(offer.pixel_format for offer in offers)),
                largest_px=max(told, key=lambda size: size[0] * size[1], default=None),
                best=best_mode(node, offers),
                controls=tuple(control.name for control in Controls(node)),
            )
    except DeviceNotFoundError as error:
        if error.__cause__ is None:
            return None  # it answered: no camera
        return VideoNode(path, stable, trouble=str(error))
    except (DeviceError, OSError) as error:
        return VideoNode(path, stable, trouble=str(error))
