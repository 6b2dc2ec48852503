"""The options of `rig capture` for robots and recorders."""

import socket
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from rig.recording import recorded_views
from rig.testing.simulated import PROFILE
from tests.support.command import Command

SHORT = ("capture", str(PROFILE), "--slopes-only", "--frames", "1")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--as", "ros2"), "give --record FILE.mcap as well"),
        (("--as", "ros1", "--record", "r.mcap"), "choose one of foxglove, ros2"),
        (("--serve-port", "1"), "go with --serve foxglove"),
        (("--serve-host", "192.0.2.1"), "go with --serve foxglove"),
        (("--points",), "--points goes with --record or --serve"),
        (("--serve", "rerun"), "choose one of foxglove"),
        (("--serve", "foxglove", "--serve-port", "65536"), "must be at most 65535"),
    ],
)
def test_options_without_what_they_belong_to_are_told(
    rig: Command, options: tuple[str, ...], told: str
):
    answer = rig(*SHORT, *options)
    assert answer.code == 2
    assert told in " ".join(answer.err.split())


def test_a_capture_is_recorded_for_ros_and_served(rig: Command, tmp_path: Path):
    bag, maps = tmp_path / "r.mcap", tmp_path / "maps"
    for_ros = ("--record", str(bag), "--as", "ros2", "--points")
    served = ("--serve", "foxglove", "--serve-port", "0")
    answer = rig(*SHORT, "--out", str(maps), *for_ros, *served)
    assert answer.code in (0, 3), answer.err
    assert "open a connection to ws://127.0.0.1:" in answer.err
    with AnyReader([bag]) as reader:
        topics = {connection.topic for connection in reader.connections}
    assert "/left/image_rect" in topics
    assert "/depth/image" not in topics


def test_a_recording_without_further_words_plays_back(rig: Command, tmp_path: Path):
    file = tmp_path / "r.mcap"
    answer = rig(*SHORT, "--out", str(tmp_path / "maps"), "--record", str(file))
    assert answer.code in (0, 3), answer.err
    assert recorded_views(file) == ("centre", "left", "right", "top", "bottom")
    refused = rig(*SHORT, "--out", str(tmp_path / "other"), "--record", str(file), "--as", "ros2")
    assert refused.code == 1
    assert "exists already" in refused.err


def test_a_port_that_is_taken_ends_the_capture_before_it_begins(rig: Command, tmp_path: Path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        served = ("--serve", "foxglove", "--serve-port", port)
        answer = rig(*SHORT, "--out", str(tmp_path / "maps"), *served)
    assert answer.code == 1
    assert f"asked to serve Foxglove at 127.0.0.1:{port}" in answer.err
    assert "--serve-port" in answer.err
