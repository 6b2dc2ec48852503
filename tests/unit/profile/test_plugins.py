"""Other people's kinds: found by their entry points; a wrong one is refused in one line."""

import subprocess
import sys
from pathlib import Path

import pytest

from rig.errors import ConfigError
from rig.profile.load import load_profile
from rig.profile.plugins import CAMERAS, STAGES
from tests.support.command import Command

GOOD = """
from typing import Literal
from rig.profile import CameraConfig
from rig.profile.kinds import CameraKind
class Config(CameraConfig):
    kind: Literal["{kind}"]
    dots: int = 3
def find(timeout_s):
    {find}
from rig.discovery import Search
KIND = CameraKind(contract={contract}, name="{kind}", config=Config,
                  open=lambda config, around: None, search=Search("{kind}", "camera.kind", find))
"""


def install(
    folder: Path,
    kind: str = "dots",
    *,
    package: str = "dots-driver",
    contract: int = 1,
    code: str = GOOD,
    find: str = "return []",
) -> None:
    """Put a package beside the others, as pip would."""
    module = package.replace("-", "_")
    text = code.replace("{kind}", kind).replace("{contract}", str(contract)).replace("{find}", find)
    (folder / f"{module}.py").write_text(text)
    about = folder / f"{module}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[rig.cameras]\n{kind} = {module}:KIND\n")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder whose packages are installed."""
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def test_a_good_one_is_a_kind_like_ours(site: Path):
    install(site, "fine", package="fine-driver")
    assert "fine" in [kind.name for kind in CAMERAS.kinds()]
    assert CAMERAS.problems() == STAGES.problems() == ()
    profile = load_profile("sim", ["camera={kind='fine', dots=5}"])
    assert profile.model_dump()["camera"]["dots"] == 5
    with pytest.raises(ConfigError, match=r"camera\.dotz: unknown key; did you mean dots\?"):
        load_profile("sim", ["camera={kind='fine', dotz=5}"])


@pytest.mark.parametrize(
    ("package", "kind", "contract", "code", "why"),
    [
        ("torn-driver", "torn", 1, "import no_such_library", "no_such_library"),
        ("raw-driver", "raw", 1, "KIND = 3", "contract None"),
        ("late-driver", "late", 2, GOOD, "made for contract 2, this rig has contract 1"),
        ("thief-driver", "oak", 1, GOOD, "rig has a camera of this name"),
        ("open-driver", "ajar", 1, GOOD + 'Config.model_config["extra"] = "allow"\n', "forbid"),
    ],
)
def test_a_wrong_one_is_one_line_with_its_package_and_all_others_work(
    site: Path, rig: Command, package: str, kind: str, contract: int, code: str, why: str
):
    install(site, kind, package=package, contract=contract, code=code)
    (line,) = CAMERAS.problems()
    assert line.startswith(package)
    assert why in line
    assert "\n" not in line
    assert {"sim", "oak", "v4l2"} <= {kind.name for kind in CAMERAS.kinds()}
    assert load_profile("sim").camera.kind == "sim"
    answer = rig("devices", "--timeout-s", "0.1", "--json")
    assert answer.code == 0
    assert answer.json["broken_plugins"] == [line]
    if kind != "oak":
        with pytest.raises(ConfigError, match=package):
            load_profile("sim", [f"camera={{kind='{kind}'}}"])


def test_two_packages_that_claim_one_kind_both_stand_back(site: Path):
    install(site, "twin", package="first-driver")
    install(site, "twin", package="second-driver")
    first, second = CAMERAS.problems()
    assert first.startswith("first-driver")
    assert "second-driver claims the name as well" in first
    assert second.startswith("second-driver")


def test_a_search_that_breaks_is_a_note(site: Path, rig: Command):
    install(site, "loose", package="loose-driver", find="raise ZeroDivisionError('of theirs')")
    answer = rig("devices", "--timeout-s", "5", "--json")
    assert answer.code == 0
    assert "loose-driver: its search failed, ZeroDivisionError" in answer.json["loose"]["note"]


def test_kinds_are_listed_without_what_they_need():
    code = (
        "import sys; from rig.profile.plugins import CAMERAS, STAGES; "
        "CAMERAS.kinds(), STAGES.kinds(); "
        "print([m for m in ('numpy', 'cv2', 'serial', 'depthai', 'mitsuba') if m in sys.modules])"
    )
    command = [sys.executable, "-c", code]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "[]\n"


def test_the_rules_for_users_are_printed(rig: Command):
    answer = rig("devices", "--udev-rules")
    assert answer.code == 0
    assert "03e7" in answer.out
    assert "dialout" in answer.out
