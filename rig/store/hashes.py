"""Files against the SHA-256 that they were stored with."""

import hashlib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_THREADS = 2
"""Disks gain little from more, and a sweep may be running."""


def bad_files(folder: Path, sha256: Mapping[str, str]) -> dict[str, str]:
    """Return what is wrong with the files of a folder, by name; nothing where all are as stored.

    Args:
        folder: where they should be.
        sha256: of every file, by name.
    """
    with ThreadPoolExecutor(_THREADS) as pool:
        found = pool.map(lambda item: (item[0], problem(folder / item[0], item[1])), sha256.items())
        return {name: wrong for name, wrong in found if wrong}


def problem(file: Path, sha256: str) -> str:
    """Say what is wrong with a file; empty where it is as it was stored."""
    try:
        content = file.read_bytes()
    except FileNotFoundError:
        return "missing"
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if digest(content) != sha256:
        return f"damaged ({len(content)} bytes, wrong SHA-256)"
    return ""


def digest(content: bytes) -> str:
    """Return the SHA-256 of some bytes."""
    return hashlib.sha256(content).hexdigest()
