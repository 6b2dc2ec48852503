"""`rig devices`: what is plugged in, and what is missing."""

from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.options import AsJson, finite
from rig.cli.output import show, show_json

if TYPE_CHECKING:
    from rig.discovery import Findings

_TITLES = {"oak": "OAK cameras", "v4l2": "V4L2 cameras", "serial": "serial ports"}


def devices(
    *,
    timeout_s: Annotated[
        float,
        typer.Option(
            "--timeout-s",
            min=0.1,
            max=600.0,
            callback=finite,
            help="Longest wait for every search.",
        ),
    ] = 1.6,
    as_json: AsJson = False,
) -> None:
    """List cameras and serial ports with the names that a profile needs.

    Nothing is opened for longer than it takes to ask what it is; no stage is reset or moved. What
    stands in the way (permission, a missing extra) is told with what to do.
    """
    from rig.hardware.find import find_devices

    found = find_devices(timeout_s)
    if as_json:
        show_json({findings.kind: findings.as_dict() for findings in found})
        return
    for findings in found:
        _show(findings)
    if not any(findings.devices for findings in found):
        show()
        show("nothing is plugged in; without hardware: rig sweep sim, then rig capture sim")
    else:
        show()
        show("a profile for them: rig profile new NAME")


def _show(findings: "Findings") -> None:
    count = len(findings.devices)
    show(f"{_TITLES[findings.kind]}: {count or 'none'}" + (f" ({findings.key})" if count else ""))
    for device in findings.devices:
        also = f"; also {', '.join(device.other_names)}" if device.other_names else ""
        show(f"  {device.name}")
        show(f"      {device.description}{also}")
        if device.problem is not None:
            show(f"      -> {device.problem}")
    if findings.note is not None:
        show(f"  -> {findings.note}")
