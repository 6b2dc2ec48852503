"""What is known of a scan, beside the pictures of its views: one file, where it is a scan."""

import json
from pathlib import Path

from rig.database.trouble import explained
from rig.files import put_on_disk
from rig.scan import SCAN_FACTS, Scan

FACTS = "scan.json"


def write_scan(folder: Path, scan: Scan, mode: int) -> None:
    """Write positions, times and light of a scan; its views hold the pixels.

    Args:
        folder: of the sample; is there.
        scan: of its multi-view.
        mode: permission bits of the file.
    """
    put_on_disk(folder / FACTS, json.dumps(SCAN_FACTS.to_json(scan.facts)).encode(), mode)


def read_scan(folder: Path) -> Scan | None:
    """Return what is known of the scan of a sample, None where its views are of one instant.

    Raises:
        StoreError: the file is damaged.
    """
    file = folder / FACTS
    if not file.is_file():
        return None
    with explained("read a scan", file):
        text = file.read_text(encoding="utf-8")
    return Scan(SCAN_FACTS.from_text(text))
