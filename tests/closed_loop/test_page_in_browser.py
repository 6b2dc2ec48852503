"""The live page in a real browser: what it shows is what the frames hold."""

import math
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.live.frame import DepthFrame
from rig.measurement import Measurement
from rig.stored import Run, optics_of
from rig.sweep.job import SweepJob
from rig.sweep.take import NewSample
from rig.view.actions import Actions, Recording, Refusal
from rig.view.calibrate_view import CalibrateMessage, CalibrateView
from rig.view.frame_message import FrameMessage
from rig.view.live_view import LiveView, capture_save
from rig.view.notices import Notices
from rig.view.server import ViewServer
from rig.view.sweep_view import SweepMessage, SweepView
from tests.support.browser import driven_browser
from tests.support.shown_frames import scene
from tests.support.shown_look import look
from tests.support.sweeps import bench_profile, stored_sweep

pytestmark = pytest.mark.slow

SCENE = scene(160, 100)
STEPS = 400
STEP_MS = 100


class Bench:
    """A server with a page that looks on; the page's own script is asked for what it shows."""

    def __init__(self, view: LiveView, server: ViewServer[FrameMessage], page: Any) -> None:
        self.view = view
        self.server = server
        self.page = page
        self.saved: list[int] = []
        self.errors: list[str] = []

    def show(self, frame: DepthFrame) -> None:
        """Hand a frame over and wait until the page has drawn it."""
        self.view.write(frame)
        self.wait(
            f"() => window.rig.app.shown?.header.frame === {frame.index} && !window.rig.app.pending"
        )

    def wait(self, met: str) -> None:
        """Wait until it holds; the page's policy lets no text be evaluated inside it."""
        for _ in range(STEPS):
            if self.page.evaluate(met):
                return
            self.page.wait_for_timeout(STEP_MS)
        pytest.fail(f"never: {met}")

    def pixels(self, canvas: str) -> NDArray[np.uint8]:
        """What is drawn on a canvas, (H, W, 4)."""
        width, height, flat = self.page.evaluate(
            """(id) => {
                const canvas = document.getElementById(id), copy = document.createElement("canvas");
                copy.width = canvas.width; copy.height = canvas.height;
                const context = copy.getContext("2d");
                context.drawImage(canvas, 0, 0);
                const { data } = context.getImageData(0, 0, copy.width, copy.height);
                return [copy.width, copy.height, Array.from(data)];
            }""",
            canvas,
        )
        return np.array(flat, np.uint8).reshape(height, width, 4)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with driven_browser() as one:
        yield one


@pytest.fixture
def bench(browser: Any) -> Iterator[Bench]:
    is_on = [False]

    def switch(to: bool, text: str) -> Callable[[], str]:
        def switched() -> str:
            is_on[0] = to
            return text

        return switched

    recording = Recording(
        switch(True, "recording into x.mcap"), switch(False, "4 are in x.mcap"), lambda: is_on[0]
    )
    saved: list[int] = []

    def save(frame: DepthFrame) -> str:
        saved.append(frame.index)
        return f"frame {frame.index} is in captures"

    actions = Actions(capture_save(save), recording)
    server = ViewServer("127.0.0.1", 0, "t", Notices(lambda _: None), actions).start()
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    one = Bench(LiveView(SCENE.run, lambda: {"skew": 3}, server), server, page)
    one.saved = saved
    page.on("pageerror", lambda error: one.errors.append(str(error)))
    page.on("console", lambda said: one.errors.append(said.text) if said.type == "error" else None)
    with closing(one.view):
        page.goto(f"{server.url}?points=4000")
        yield one
        assert one.errors == []
        page.close()


def test_the_number_under_the_cursor_is_the_maps_value(bench: Bench):
    frame = SCENE.frame(0)
    bench.show(frame)
    box = bench.page.locator("#over").bounding_box()
    for x, y in ((20, 30), (80, 48), (140, 90), (101, 7)):
        bench.page.mouse.move(
            box["x"] + (x + 0.5) / 160 * box["width"], box["y"] + (y + 0.5) / 100 * box["height"]
        )
        bench.wait(f"() => document.getElementById('facts').textContent.includes('{x}, {y}')")
        told = bench.page.inner_text("#value")
        if frame.label[y, x] == 0:
            assert told == "no answer"
            continue
        value, sigma = (float(part.split()[0]) for part in told.split("±"))
        assert told.endswith("mm (k=2)")
        step_mm = 0.05
        assert value == pytest.approx(float(frame.depth_mm[y, x]), abs=0.05 + step_mm / 2)
        assert sigma == pytest.approx(2.0 * float(frame.sigma_mm[y, x]), abs=0.05 + step_mm / 2)


def test_pictures_move_and_colours_follow_depth(bench: Bench):
    bench.show(SCENE.frame(0, sway_mm=-150.0))
    left = bench.pixels("map")
    bench.show(SCENE.frame(1, sway_mm=150.0))
    right = bench.pixels("map")
    red = [int(np.argmax(one[45, :, 0].astype(int) - one[45, :, 2])) for one in (left, right)]
    assert red[0] < 75 < 85 < red[1], "the ball is near, so it is warm, and it went right"
    blind = SCENE.frame(1, sway_mm=150.0).label == 0
    assert len(np.unique(right[blind], axis=0)) == 1


def test_the_cloud_shows_the_ball_before_the_wall(bench: Bench):
    bench.show(SCENE.frame(0))
    bench.page.keyboard.press("5")
    bench.wait("() => !document.getElementById('cloud').hidden && Boolean(window.rig.cloud.gl)")
    bench.show(SCENE.frame(1))
    front = bench.pixels("cloud")[..., :3].astype(int)
    back = front[0, 0]
    drawn = np.any(front != back, axis=-1).mean()
    assert drawn > 0.2
    assert (front[..., 0] - front[..., 2] > 60).mean() > 0.01, "something warm: near"
    bench.page.evaluate("() => window.rig.cloud.turn(0.5, 0)")
    bench.wait("() => !window.rig.app.pending")
    turned = bench.pixels("cloud")[..., :3].astype(int)
    assert np.any(turned != front, axis=-1).mean() > 0.1


def test_colour_is_shown_by_picture_and_cloud_and_comes_only_then(bench: Bench):
    frame = SCENE.frame(0)
    colour = np.stack([frame.image, frame.image // 2, 255 - frame.image], axis=-1)
    in_colour = replace(frame, colour=colour)
    bench.show(in_colour)
    assert not bench.page.evaluate("() => Boolean(window.rig.app.shown.colour())")
    bench.page.keyboard.press("4")
    bench.wait("() => Boolean(window.rig.app.shown.colour()) && !window.rig.app.pending")
    assert np.array_equal(bench.pixels("map")[..., :3], colour)
    bench.wait("() => document.getElementById('facts').textContent.includes('red, green, blue')")
    r, g, b = colour[50, 80].tolist()
    assert f"{r}, {g}, {b}" in bench.page.inner_text("#facts")
    bench.page.keyboard.press("5")
    bench.wait("() => !document.getElementById('cloud').hidden && Boolean(window.rig.cloud.gl)")
    bench.show(replace(in_colour, index=1, colour=np.full_like(colour, (250, 10, 200))))
    drawn = bench.pixels("cloud")[..., :3].astype(int)
    assert (np.abs(drawn - (250, 10, 200)).max(axis=-1) <= 2).mean() > 0.2
    bench.page.keyboard.press("1")
    bench.show(replace(in_colour, index=2))
    assert not bench.page.evaluate("() => Boolean(window.rig.app.shown.colour())")


def plane_by_numpy(frame: DepthFrame, region: tuple[int, int, int, int]) -> dict[str, float]:
    left, top, right, bottom = region
    inside = np.zeros(frame.label.shape, bool)
    inside[top : bottom + 1, left : right + 1] = True
    known = inside & (frame.label > 0)
    points = frame.points_mm()[known]
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    normal *= np.sign(normal[2])
    away = (points - middle) @ normal
    on_plane = (points[:, 2] / (points @ normal)) * (middle @ normal)
    scale = frame.camera.focal_px * SCENE.run.profile.pitch_mm
    x, y = (left + right) / 2, (top + bottom) / 2
    centre = np.array([(x - 80.0) / frame.camera.focal_px, (y - 50.0) / frame.camera.focal_px, 1.0])
    return {
        "fill_pct": 100.0 * float(known.sum() / inside.sum()),
        "rms_mm": float(np.sqrt(np.mean(away**2))),
        "flatness_mm": float(np.subtract(*np.percentile(away, [99, 1]))),
        "subpixel_px": float(np.sqrt(np.mean((scale * (1 / points[:, 2] - 1 / on_plane)) ** 2))),
        "distance_mm": float(middle @ normal / (centre @ normal)),
        "tilt_deg": math.degrees(math.acos(normal[2])),
    }


def test_the_plane_of_a_drawn_region_is_numpys(bench: Bench):
    frame = SCENE.frame(0, sway_mm=-150.0)
    bench.show(frame)
    bench.page.keyboard.press("g")
    box = bench.page.locator("#over").bounding_box()
    place = lambda x, y: (  # noqa: E731
        box["x"] + (x + 0.5) / 160 * box["width"],
        box["y"] + (y + 0.5) / 100 * box["height"],
    )
    bench.page.mouse.move(*place(100, 10))
    bench.page.mouse.down()
    bench.page.mouse.move(*place(150, 45))
    bench.page.mouse.up()
    bench.page.fill("#truth", "1100")
    found = bench.page.evaluate(
        "() => window.rig.qualityOf(window.rig.app.shown, window.rig.app.marks.region, 1100)"
    )
    wanted = plane_by_numpy(frame, (100, 10, 150, 45))
    assert found["pixels"] == 51 * 36
    # A step of the map is 0.05 mm; it is lost evenly, 0.014 mm rms.
    for name, tolerance in (
        ("fill_pct", 1e-9),
        ("rms_mm", 2e-3),
        ("flatness_mm", 0.05),
        ("subpixel_px", 1e-4),
        ("distance_mm", 2e-3),
        ("tilt_deg", 1e-3),
    ):
        assert found[name] == pytest.approx(wanted[name], abs=tolerance), name
    assert found["accuracy_mm"] == pytest.approx(wanted["distance_mm"] - 1100.0, abs=2e-3)
    told = bench.page.inner_text("#plane")
    assert f"{wanted['fill_pct']:.1f} %" in told
    assert f"{found['rms_mm']:.2f} mm" in told


def test_a_profile_is_the_map_along_the_line(bench: Bench):
    frame = SCENE.frame(0)
    bench.show(frame)
    samples = bench.page.evaluate(
        "() => window.rig.alongLine("
        "window.rig.app.shown, {from: {x: 10, y: 40}, to: {x: 110, y: 40}})"
        ".map((one) => [one.at, Number.isNaN(one.value) ? null : one.value, one.sigma])"
    )
    assert [one[0] for one in samples] == pytest.approx(list(range(101)))
    row = frame.depth_mm[40, 10:111]
    for (_, value, sigma), wanted, known in zip(
        samples, row, frame.sigma_mm[40, 10:111], strict=True
    ):
        assert (value is None) == bool(np.isnan(wanted))
        if value is not None:
            assert value == pytest.approx(float(wanted), abs=0.03)
            assert sigma == pytest.approx(float(known), abs=0.01)


def test_frozen_pictures_stay_and_what_is_shown_is_saved(bench: Bench):
    bench.show(SCENE.frame(0))
    bench.page.keyboard.press(" ")
    assert bench.page.inner_text("#state") == "frozen"
    for index in (1, 2, 3):
        bench.view.write(SCENE.frame(index))
    bench.page.keyboard.press("s")
    bench.wait("() => document.getElementById('notice').textContent !== ''")
    shown = bench.page.evaluate("() => window.rig.app.shown.header.frame")
    assert bench.page.inner_text("#notice") == f"frame {shown} is in captures"
    assert bench.saved == [shown]
    bench.page.keyboard.press(" ")
    bench.wait("() => window.rig.app.shown.header.frame === 3")


def test_a_recording_starts_and_stops_by_key(bench: Bench):
    bench.show(SCENE.frame(0))
    bench.page.keyboard.press("r")
    bench.wait("() => document.getElementById('record').textContent.includes('Stop')")
    assert bench.page.inner_text("#notice") == "recording into x.mcap"
    bench.page.keyboard.press("r")
    bench.wait("() => document.getElementById('record').textContent.includes('Record')")
    assert bench.page.inner_text("#notice") == "4 are in x.mcap"


def test_the_vitals_and_the_views_are_there(bench: Bench):
    bench.show(SCENE.frame(0))
    bench.wait("() => document.querySelectorAll('#views .score')[4]?.textContent !== ''")
    assert bench.page.inner_text("#rig") == "simulated-rig"
    assert bench.page.inner_text("#drops") == "3"
    assert bench.page.inner_text("#measuring") == "21 ms"
    assert bench.page.locator("#views figure").count() == 5
    scores = bench.page.evaluate(
        "() => [0, 1, 2, 3, 4].map((i) => "
        "window.rig.sharpness(window.rig.app.shown.arrays['view_' + i].data, 160, 100))"
    )
    for score, one in zip(scores, SCENE.frame(0).views.frames, strict=True):
        grey = one.image.astype(float)
        bend = (
            4 * grey[1:-1, 1:-1]
            - grey[:-2, 1:-1]
            - grey[2:, 1:-1]
            - grey[1:-1, :-2]
            - grey[1:-1, 2:]
        )
        inner = bend[24:74, 39:119]
        mean = grey[25:75, 40:120].mean()
        assert score == pytest.approx(100.0 * np.sqrt((inner**2).mean()) / mean, rel=1e-9)


def test_the_end_is_said_and_the_last_frame_stays(bench: Bench):
    bench.show(SCENE.frame(0))
    bench.server.close()
    bench.wait("() => document.getElementById('state').textContent === 'ended'")
    assert "The run has ended" in bench.page.inner_text("#notice")
    assert bench.page.evaluate("() => window.rig.app.shown.header.frame") == 0


def test_slopes_alone_are_shown_in_px(bench: Bench):
    frame = SCENE.frame(0, has_depth=False)
    bench.show(frame)
    assert bench.page.inner_text("#maptab") == "Slope"
    told = bench.page.inner_text("#value")
    assert told.endswith("px per step (k=2)")
    value = float(told.split()[0].replace("−", "-"))
    assert value == pytest.approx(float(frame.slopes.slope_px[50, 80]), abs=6e-4)
    bench.page.keyboard.press("5")
    bench.wait("() => document.getElementById('empty').textContent.includes('needs a curve')")


def test_a_button_that_cannot_says_why(browser: Any):
    actions: Actions[FrameMessage] = Actions(Refusal("all is kept"), Refusal("-"))
    server = ViewServer("127.0.0.1", 0, "t", Notices(lambda _: None), actions).start()
    page = browser.new_page()
    with closing(LiveView(SCENE.run, dict, server)):
        one = Bench(LiveView(SCENE.run, dict, server), server, page)
        page.goto(server.url)
        one.show(SCENE.frame(0))
        page.click("#save")
        assert page.inner_text("#notice") == "all is kept"
        page.close()


def test_a_sweep_shows_corners_and_the_curve(browser: Any, tmp_path: Path):
    store, result = stored_sweep(tmp_path)
    with store:
        sample = store.samples(result.sweep_id)[0]
        new = NewSample(sample.stop, sample.number, sample.reached_mm, store.load(sample))
    profile = bench_profile()
    stops = tuple(one.stop for one in result.stops)
    job = SweepJob(Run(profile, optics_of(profile, None)), stops, samples=2)
    corners = tuple(tuple((80.0 + 20 * x, 60.0 + 20 * y) for x in range(8)) for y in range(5))
    server = ViewServer[SweepMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    with closing(server):
        watcher = SweepView(server)
        watcher.begins(job, 0)
        page.goto(server.url)
        watcher.took(new, sample.key)
        watcher.measured({sample.key: Measurement(slope_px=4.5, corners_px=corners)})
        watcher.concluded(result)
        for _ in range(STEPS):
            if page.evaluate("() => document.getElementById('headline').textContent !== ''"):
                break
            page.wait_for_timeout(STEP_MS)
        assert page.inner_text("#headline") == str(result.headline)
        assert page.inner_text("#mode") == "sweep"
        assert page.inner_text("#sweep-value") == "400.0 mm"
        assert f"1 of {len(stops)}" in page.inner_text("#sweep-facts")
        assert page.locator("#sweep-views figure").count() == len(profile.views)
        assert not page.locator("#freeze").is_visible()
        drawn = page.evaluate(
            """() => ["board", "board-over", "plan", "curve", "errors"].map((id) => {
                const canvas = document.getElementById(id);
                const { width, height } = canvas;
                const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
                return data.filter((one, k) => k % 4 === 3 && one > 0).length / (data.length / 4);
            })"""
        )
        assert drawn[0] == 1.0
        assert all(0.0005 < share < 0.5 for share in drawn[1:]), drawn
        page.screenshot(path=tmp_path / "sweep.png")
        assert errors == []
        page.close()


def test_a_calibration_shows_corners_and_what_is_covered(browser: Any):
    server = ViewServer[CalibrateMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    with closing(server):
        page.goto(server.url)
        CalibrateView(server).show(look())
        for _ in range(STEPS):
            if page.evaluate("() => document.getElementById('advice').textContent.length > 1"):
                break
            page.wait_for_timeout(STEP_MS)
        assert page.inner_text("#advice") == "bring it nearer, to about 400 mm"
        assert "in 4 of 5 views" in page.inner_text("#cal-facts")
        assert "left: the board is cut off at the left" in page.inner_text("#cal-problems")
        assert page.inner_text("#cal-hint") == "0.500 % after 24 pictures"
        assert page.locator("#cal-views figure").count() == 5
        green = page.evaluate(
            """() => {
                const { data } = document.querySelector("#cal-views canvas").getContext("2d")
                    .getImageData(0, 0, 64, 40);
                const at = (x, y) => data[4 * (64 * y + x) + 1] - data[4 * (64 * y + x)];
                return [at(6, 5), at(60, 35)];
            }"""
        )
        assert green[0] > 15, "a part that is covered is greener"
        assert green[1] == 0
        assert errors == []
        page.close()
