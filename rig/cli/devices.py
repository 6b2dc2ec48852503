"""`rig devices`: what is plugged in, and what is missing."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, finite
from rig.cli.output import show, show_json

if TYPE_CHECKING:
    from rig.discovery import Findings


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
    udev_rules: Annotated[
        bool,
        typer.Option(
            "--udev-rules", help="Print rules that let users open devices (Linux), and end."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """List cameras and serial ports with the names that a profile needs.

    Nothing is opened for longer than it takes to ask what it is; no stage is reset or moved. What
    stands in the way (permission, a missing extra) is told with what to do.
    """
    from rig.hardware import find

    if udev_rules:
        show(find.udev_rules().rstrip())
        return
    found, broken = find.find_devices(timeout_s), find.broken_plugins()
    if as_json:
        listed: dict[str, object] = {findings.kind: as_dict(findings) for findings in found}
        show_json({**listed, **({"broken_plugins": list(broken)} if broken else {})})
        return
    for findings in found:
        _show(findings)
    for line in broken:
        show(f"plug-in -> {line}")
    if not any(findings.devices for findings in found):
        show()
        show("nothing is plugged in; without hardware: rig sweep sim, then rig capture sim")
        tell_next("devices, none", as_json=False)
    else:
        show()
        show("a profile for them: rig profile new NAME")
        tell_next("devices", as_json=False)


def as_dict(findings: "Findings") -> dict[str, object]:
    """Return what `--json` prints of one search."""
    return {
        "key": findings.key,
        "devices": [asdict(device) for device in findings.devices],
        "note": findings.note,
        "took_s": round(findings.took_s, 3),
    }


def _show(findings: "Findings") -> None:
    count = len(findings.devices)
    show(f"{findings.title}: {count or 'none'}" + (f" ({findings.key})" if count else ""))
    for device in findings.devices:
        also = f"; also {', '.join(device.other_names)}" if device.other_names else ""
        show(f"  {device.name}")
        show(f"      {device.description}{also}")
        if device.problem is not None:
            show(f"      -> {device.problem}")
    if findings.note is not None:
        show(f"  -> {findings.note}")
