from pathlib import Path

import pytest

from sim.llvm import VARIABLE, named_major, usable_llvm


@pytest.mark.parametrize(
    ("name", "major"),
    [
        ("libLLVM-14.so.1", 14),
        ("libLLVM-14.0.6.so", 14),
        ("libLLVM-19.so", 19),
        ("libLLVM.so.19.1", 19),
        ("libLLVM.so.22.1", 22),
        ("libLLVM.so", None),
        ("libLLVMCore.a", None),
        ("libLLVM-C.so", None),
    ],
)
def test_the_version_is_in_the_name(name: str, major: int | None):
    assert named_major(name) == major


def test_a_chosen_library_that_is_none_is_refused_with_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
):
    fake = tmp_path / "libLLVM-19.so"
    fake.write_text("no library")
    monkeypatch.setenv(VARIABLE, str(fake))
    assert usable_llvm() is None
    assert "eight times slower" in caplog.text
