"""A sweep as a page sees it."""

import json
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect

from rig.cli.page_options import sweep_page
from rig.measurement import Failure, Measurement
from rig.stored import Run, optics_of
from rig.sweep.job import SweepJob
from rig.sweep.take import NewSample
from rig.view.notices import Notices
from rig.view.server import ViewServer
from rig.view.sweep_view import SweepMessage, SweepView
from rig.view.wire import decode
from tests.support.sweeps import bench_profile, stored_sweep

SOON_S = 20.0


class Looking:
    """A page that takes every message."""

    def __init__(self, page: ClientConnection) -> None:
        self._page = page

    def next(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        while isinstance(message := self._page.recv(SOON_S), str):
            pass
        header, arrays = decode(message)
        self._page.send(json.dumps({"ack": header["number"]}))
        return header, arrays


@pytest.fixture
def served() -> Iterator[tuple[SweepView, Looking]]:
    server = ViewServer[SweepMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
    url = f"ws://127.0.0.1:{server.port}/t/live"
    with closing(server), connect(url, max_size=None, compression=None) as page:
        yield SweepView(server), Looking(page)


@pytest.mark.slow
def test_a_sweep_is_told_from_its_plan_to_its_curve(
    served: tuple[SweepView, Looking], tmp_path: Path
):
    view, page = served
    store, result = stored_sweep(tmp_path)
    profile = bench_profile()
    job = SweepJob(
        Run(profile, optics_of(profile, None)), tuple(s.stop for s in result.stops), samples=2
    )
    with store:
        samples = store.samples(result.sweep_id)
        new = [
            NewSample(one.stop, one.number, one.reached_mm, store.load(one)) for one in samples[:2]
        ]
    view.begins(job, 0)
    header, arrays = page.next()
    assert header["mode"] == "sweep"
    assert (header["rig"], header["at"], header["done"]) == ("bench", None, 0)
    assert header["total"] == 2 * len(result.stops)
    assert header["stops"][0] == {"mm": 400.0, "role": "fit", "direction": "forward"}
    assert arrays == {}

    view.took(new[0], samples[0].key)
    header, arrays = page.next()
    assert (header["at"], header["sample"], header["done"]) == (0, 0, 1)
    for number, picture in enumerate(new[0].multiview.images):
        np.testing.assert_array_equal(arrays[f"view_{number}"], picture)
    assert "image" not in arrays, "nothing is measured yet"

    corners = (((10.0, 20.0), (30.0, 20.5)),)
    good = Measurement(
        slope_px=4.5, sigma_px=0.01, corners_px=corners, outline_px=((1.0, 2.0),) * 4,
        track_residual_px=0.04,
    )  # fmt: skip
    view.measured({})
    view.measured({samples[0].key: good})
    header, arrays = page.next()
    assert header["points"] == [
        {"mm": new[0].reached_mm, "px": 4.5, "role": "fit", "direction": "forward"}
    ]
    assert header["corners"] == [[10.0, 20.0], [30.0, 20.5]]
    assert header["outline"] == [[1.0, 2.0]] * 4
    assert header["residual_px"] == 0.04
    assert header["problem"] is None
    reference = new[0].multiview.frames[profile.reference].image
    np.testing.assert_array_equal(arrays["image"], reference)

    view.took(new[1], samples[1].key)
    page.next()
    view.measured({samples[1].key: Measurement(failure=Failure("blurred", "board is blurred"))})
    header, _ = page.next()
    assert header["failures"] == 1
    assert header["problem"] == "board is blurred"
    assert len(header["points"]) == 1
    assert header["corners"] == []
    assert header["result"] is None

    view.measured({(9, 9): good})
    header, _ = page.next()
    assert len(header["points"]) == 1, "taken before the sweep was interrupted: no distance here"

    view.concluded(result)
    told = page.next()[0]["result"]
    assert told["headline"] == str(result.headline)
    assert told["model"] == result.fit.best.model
    assert told["gates"] == list(result.failed_gates)
    assert result.fit.holdout is not None
    assert told["rms_mm"] == result.fit.holdout.rms_mm
    assert told["holdout"] == [
        [one.point.distance_mm, one.error_mm] for one in result.fit.holdout.residuals
    ]
    first_mm, first_px = told["curve"][5]
    assert first_px == pytest.approx(float(result.fit.best.slope_px(np.array([first_mm]))[0]))
    assert len(told["curve"]) > 100


def test_without_the_option_nobody_watches():
    with sweep_page(None, print) as shown:
        assert shown.watcher is None
        assert shown.bystander is None
