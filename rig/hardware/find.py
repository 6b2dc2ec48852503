"""What is plugged in: every driver's own list, all at the same time."""

from pathlib import Path

from rig.discovery import Findings, FoundDevice, Search, search_all


def find_devices(timeout_s: float) -> tuple[Findings, ...]:
    """List the cameras and serial ports of this machine, all searches at the same time.

    Args:
        timeout_s: longest wait for all of them together.
    """
    return search_all(
        (
            Search("oak", "camera.device", _find_oaks),
            Search("v4l2", "camera.devices", _find_v4l2),
            Search("serial", "stage.port", _find_serial_ports),
        ),
        timeout_s,
    )


def _find_oaks(timeout_s: float) -> list[FoundDevice]:
    from rig_drivers.oak.inventory import list_oaks

    return [
        FoundDevice(oak.name, oak.description, oak.other_names, oak.problem)
        for oak in list_oaks(timeout_s)
    ]


def _find_v4l2(_timeout_s: float) -> list[FoundDevice]:
    if not any(Path("/dev").glob("video[0-9]*")):
        return []  # what it takes to ask them is imported for them only
    from rig_drivers.v4l2.inventory import video_nodes
    from rig_drivers.v4l2.kernel import LinuxKernel

    return [
        FoundDevice(
            str(node.best_path),
            f"{node.card or 'camera'}; {', '.join(node.pixel_formats) or 'formats unknown'}",
            tuple(str(path) for path in (*node.stable_paths[1:], node.path)),
            node.trouble,
        )
        for node in video_nodes(LinuxKernel())
    ]


def _find_serial_ports(_timeout_s: float) -> list[FoundDevice]:
    from rig_drivers.permission import why_not_permitted
    from rig_drivers.stage.serial_ports import list_serial_ports

    return [
        FoundDevice(
            port.name,
            port.description if port.description != "n/a" else "on the main board",
            tuple(name for name in (port.path, port.usb_serial) if name and name != port.name),
            why_not_permitted(Path(port.path)),
        )
        for port in list_serial_ports()
    ]
