"""The names that are promised, what they cost, and the example that the pages show."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rig

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "reference" / "python-api.md"


def python(*arguments: str, folder: Path = ROOT) -> str:
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_every_promised_name_is_there_and_on_the_page():
    homes = rig._HOMES
    assert {*homes, "__version__"} == set(rig.__all__)
    assert set(rig.__all__) <= set(dir(rig))
    page = PAGE.read_text()
    for name in rig.__all__:
        assert getattr(rig, name) is not None
        assert f"`rig.{name}" in page
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        _ = rig.opne  # pyright: ignore[reportAttributeAccessIssue]


def test_importing_it_loads_nothing():
    loaded = python("-c", "import rig, sys; print([m for m in sys.modules if m[:4] == 'rig.'])")
    assert loaded.strip() == "[]"
    heavy = "{'numpy', 'cv2', 'pydantic', 'sqlalchemy'}"
    assert python("-c", f"import rig, sys; print({heavy} & set(sys.modules))") == "set()\n"


def examples(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", [PAGE, ROOT / "README.md"], ids=["page", "readme"])
def test_the_example_runs_as_it_is_printed(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    example = examples(page)[0]
    assert len(example.splitlines()) <= 15
    stored_as_my_rig(tmp_path, monkeypatch)
    exec(compile(example, str(page), "exec"), {})  # noqa: S102 - our own page
    assert re.search(r"\d+ mm", capsys.readouterr().out)


def stored_as_my_rig(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the simulated rig `my-rig`, with its curve in a database of its own."""
    from rig.database import open_store
    from rig.profile.load import load_profile
    from rig.testing.simulated import CURVE, PROFILE
    from tests.support.stores import STOPS

    profiles = folder / "calib_profiles"
    profiles.mkdir()
    text = PROFILE.read_text().replace('name = "simulated-rig"', 'name = "my-rig"')
    (profiles / "my-rig.toml").write_text(text)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("RIG_DATABASE", f"sqlite:///{folder}/rig.sqlite")
    with open_store() as store:
        sweep = store.create_sweep(
            rig="my-rig",
            profile=load_profile("my-rig").model_dump(mode="json"),
            stops=STOPS,
            samples_per_stop=1,
            versions={},
            devices={},
        )
        curve = rig.load_curve(CURVE).to_json()
        store.save_curve(sweep, curve=curve, holdout={"rms_pct": 0.01}, versions={})


USER_TEST = """
import numpy as np

def test_depth(rig_camera):
    frame = rig_camera.grab()
    assert abs(np.nanmedian(frame.depth_mm[40:60, 60:100]) - 550) < 5

def test_loop(rig_camera):
    for frame in rig_camera:
        assert frame.points_mm().shape == (100, 160, 3)
        if frame.index == 1:
            break
"""


@pytest.mark.slow
def test_the_fixture_serves_other_peoples_tests_and_costs_nothing_unused(tmp_path: Path):
    (tmp_path / "test_user.py").write_text(USER_TEST)
    plugin = ("-m", "pytest", "-p", "no:epirig", "-p", "rig.testing.plugin", "-q")
    told = python(*plugin, "-p", "no:cacheprovider", folder=tmp_path)
    assert "2 passed" in told
    before = python(
        "-c",
        "import pytest, sys; before = set(sys.modules); import rig.testing.plugin; "
        "print(sorted(m.partition('.')[0] for m in set(sys.modules) - before))",
    )
    assert not {"numpy", "cv2", "numba", "pydantic", "sqlalchemy"} & set(ast.literal_eval(before))
