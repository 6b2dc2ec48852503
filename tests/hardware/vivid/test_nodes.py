"""Formats and controls of the kernel's virtual camera, beside what `v4l2-ctl` says of them."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rig_drivers.v4l2.controls import Controls
from rig_drivers.v4l2.formats import Mode, pixel_formats, rate_offers, size_offers
from rig_drivers.v4l2.inventory import video_nodes
from rig_drivers.v4l2.kernel import LinuxKernel
from rig_drivers.v4l2.node import Node

from rig.errors import ConfigError, DeviceNotFoundError
from tests.hardware.vivid.bench import capture_path, one_camera, use_webcam, v4l2_ctl

pytestmark = pytest.mark.slow

Table = dict[tuple[str, int, int], list[float]]


@pytest.fixture
def path() -> Path:
    use_webcam(0)
    return capture_path(0)


@pytest.fixture
def node(path: Path) -> Iterator[Node]:
    with Node(path, LinuxKernel()) as opened:
        yield opened


def told_by_v4l2_ctl(path: Path, wanted: set[str]) -> Table:
    table: Table = {}
    name, size = "", (0, 0)
    for line in v4l2_ctl(path, "--list-formats-ext").splitlines():
        if found := re.search(r"\]: '(.+?)\s*'", line):
            name = found[1]
        elif found := re.search(r"Size: Discrete (\d+)x(\d+)", line):
            size = (int(found[1]), int(found[2]))
        elif (found := re.search(r"\(([\d.]+) fps\)", line)) and name in wanted:
            table.setdefault((name, *size), []).append(float(found[1]))
    return table


def test_formats_sizes_and_rates_are_those_of_v4l2_ctl(node: Node, path: Path):
    wanted = {"GREY", "Y10", "Y12", "Y16", "YUYV", "NV12"}
    assert wanted <= set(pixel_formats(node))
    ours: Table = {}
    for offer in size_offers(node):
        if offer.pixel_format in wanted:
            mode = Mode(offer.pixel_format, offer.width_px.least, offer.height_px.least)
            ours[mode.pixel_format, mode.width_px, mode.height_px] = [
                round(float(1 / rate.shortest_s), 3) for rate in rate_offers(node, mode)
            ]
    assert len(ours) >= 12
    assert ours == told_by_v4l2_ctl(path, wanted)


def test_controls_limits_and_values_are_those_of_v4l2_ctl(node: Node, path: Path):
    controls = Controls(node)
    pattern = re.compile(
        r"^\s*(\w+) 0x([0-9a-f]+) \((int|bool|menu|intmenu)\)\s*:(?: min=(-?\d+) max=(-?\d+))?"
        r".*? value=(-?\d+)",
        re.MULTILINE,
    )
    told = pattern.findall(v4l2_ctl(path, "--list-ctrls"))
    assert len(told) >= 20
    for name, number, kind, least, most, value in told:
        control = controls.named(name)
        assert control.number == int(number, 16)
        assert controls.read(control) == int(value), name
        if kind == "int":
            assert (control.least, control.most) == (int(least), int(most))


def test_what_we_set_v4l2_ctl_reads_and_the_other_way_round(node: Node, path: Path):
    controls = Controls(node)
    assert controls.apply({"brightness": 77, "test_pattern": "100% Black"})["brightness"] == 77
    said = v4l2_ctl(path, "--get-ctrl=brightness,test_pattern")
    assert "brightness: 77" in said
    chosen = re.search(r"test_pattern: (\d+)", said)
    assert chosen is not None
    assert controls.named("test_pattern").menu[int(chosen[1])] == "100% Black"
    v4l2_ctl(path, "--set-ctrl=brightness=128,test_pattern=0")
    assert controls.read(controls.named("brightness")) == 128


def test_what_the_camera_does_not_offer_is_refused_with_the_nearest(path: Path):
    with pytest.raises(ConfigError, match="nearest it offers is GREY 320 x 180 at 10 Hz"):
        one_camera(width_px=300, height_px=200).__enter__()
    with pytest.raises(ConfigError, match=r"at 7 Hz, the nearest it offers is .* at [58] Hz"):
        one_camera(rate_hz=7).__enter__()
    with pytest.raises(ConfigError, match="MJPG 320 x 180 at 10 Hz, the nearest it offers is"):
        one_camera(pixel_format="MJPG").__enter__()


def test_absent_controls_and_wrong_values_are_refused(path: Path):
    with pytest.raises(ConfigError, match=r"camera\.exposure_s, has no control for it"):
        one_camera(exposure_s=0.01).__enter__()
    with pytest.raises(ConfigError, match=r"camera\.focus, has no control for it"):
        one_camera(focus=3).__enter__()
    with pytest.raises(ConfigError, match=r"gain: asked for 300, may be 0\.\.255"):
        one_camera(gain=300).__enter__()
    with pytest.raises(ConfigError, match="no control brightnes; did you mean brightness"):
        one_camera(controls={"brightnes": 3}).__enter__()


def test_gain_ends_its_automatism_and_is_refused_while_that_rules(path: Path):
    v4l2_ctl(path, "--set-ctrl=gain_automatic=1")
    with one_camera(gain=42) as camera:
        assert "gain=42" in camera.identity["controls"].split()
        assert "gain_automatic=0" in camera.identity["controls"].split()
    wrong = {"gain_automatic": True, "gain": 17}
    with pytest.raises(ConfigError, match="control gain"):
        one_camera(controls=wrong).__enter__()
    v4l2_ctl(path, "--set-ctrl=gain_automatic=0")


@pytest.mark.parametrize(
    ("name", "full"), [("Y10", 1023), ("Y12", 4095), ("Y16", 65535), ("YUYV", 255), ("NV12", 255)]
)
def test_every_pixel_format_shows_the_same_picture_as_grey(path: Path, name: str, full: int):
    still = {"osd_text_mode": "None", "test_pattern": "Gray Ramp"}
    with one_camera(controls=still) as camera:
        grey = camera.grab(10.0).frames[0]
    with one_camera(controls=still, pixel_format=name) as camera:
        other = camera.grab(10.0).frames[0]
    assert other.full_scale == full
    assert other.image.shape == grey.image.shape
    ours = other.image.astype(float) * 255.0 / full
    theirs = grey.image.astype(float)
    gain, offset = np.polyfit(theirs.ravel(), ours.ravel(), 1)  # ranges differ: full or limited
    assert 0.8 < gain < 1.25
    assert np.abs(theirs * gain + offset - ours).max() < 3.0
    assert np.ptp(grey.image) > 200


def test_the_inventory_names_every_camera_by_its_stable_path(path: Path):
    nodes = video_nodes(LinuxKernel())
    ours = next(node for node in nodes if path in node.stable_paths)
    assert ours.best_path == path
    assert ours.card == "vivid"
    assert ours.trouble is None
    assert {"GREY", "YUYV"} <= set(ours.pixel_formats)
    assert "brightness" in ours.controls
    assert len(nodes) == 5  # not the nodes that pictures are written to


def test_a_path_that_is_not_there_is_not_found():
    with pytest.raises(DeviceNotFoundError, match="is not there"):
        Node(Path("/dev/v4l/by-path/nothing"), LinuxKernel()).__enter__()
    with pytest.raises(DeviceNotFoundError, match="is no video device"):
        Node(Path("/dev/null"), LinuxKernel()).__enter__()
