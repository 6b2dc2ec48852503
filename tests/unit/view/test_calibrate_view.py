"""A calibration as a page sees it."""

import json
from contextlib import closing

import numpy as np
from websockets.sync.client import connect

from rig.calibrate.watch import unwatched
from rig.cli.page_options import calibrate_page
from rig.view.calibrate_view import CalibrateMessage, CalibrateView
from rig.view.notices import Notices
from rig.view.server import ViewServer
from rig.view.wire import decode
from tests.support.shown_look import look

SOON_S = 20.0


def test_a_look_tells_corners_coverage_and_what_to_show_next():
    one = look()
    header, arrays = decode(CalibrateMessage(one).encoded(9, frozenset({"views"})))
    assert (header["mode"], header["number"], header["rig"]) == ("calibrate", 9, "simulated-rig")
    assert header["corners"][0] == [[10.0, 20.0], [30.13, 20.5]]
    assert header["corners"][1] == []
    assert header["problems"][:2] == [None, "the board is cut off at the left"]
    assert header["moving"] is True
    assert header["kept"] == 3
    assert header["advice"] == "bring it nearer, to about 400 mm"
    assert header["cells"][0] == [[True, *[False] * 4], *[[False] * 5] * 3]
    assert not np.any(header["cells"][1:])
    assert header["errors"] == [[12, 1.5], [24, 0.5]], "a solve that foretells nothing is left out"
    assert header["x_steps"] == [0.0, -1.06, 0.93, 0.0, 0.0]
    assert [view["name"] for view in header["views"]] == [
        "centre",
        "left",
        "right",
        "top",
        "bottom",
    ]
    assert list(arrays) == [f"view_{i}" for i in range(5)]
    np.testing.assert_array_equal(arrays["view_2"], one.picture.multiview.frames[2].image)


def test_nothing_is_sent_that_is_not_asked_for():
    _, arrays = decode(CalibrateMessage(look()).encoded(9, frozenset()))
    assert arrays == {}


def test_every_look_reaches_who_looks_on():
    server = ViewServer[CalibrateMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
    url = f"ws://127.0.0.1:{server.port}/t/live"
    with closing(server), connect(url, max_size=None, compression=None) as page:
        assert "recording" in json.loads(page.recv(SOON_S))
        CalibrateView(server).show(look())
        message = page.recv(SOON_S)
        assert isinstance(message, bytes)
        assert decode(message)[0]["kept"] == 3


def test_without_the_option_nobody_watches():
    with calibrate_page(None, print) as watch:
        assert watch is unwatched
