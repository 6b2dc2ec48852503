"""Pairing at its borders. Times are multiples of powers of two, so that they are exact."""

import pytest
from rig_drivers.array.pairing import Drop, Pairing

PERIOD_S = 1.0 / 8.0
EPS_S = 1.0 / 4096.0


def pairing(cameras: int = 2, *, max_skew_s: float = 1.0, is_static: bool = False) -> Pairing[str]:
    return Pairing[str](cameras, period_s=PERIOD_S, max_skew_s=max_skew_s, is_static=is_static)


def begun(**changes: object) -> Pairing[str]:
    """Two cameras that have given one pair, at 0.5 s."""
    found = pairing(**changes)  # pyright: ignore[reportArgumentType]
    assert found.push(0, 0.5, "a0").groups == []
    assert found.push(1, 0.5, "b0").groups == [("a0", "b0")]
    return found


@pytest.mark.parametrize(("late_s", "is_pair"), [(0.0, True), (EPS_S, False)])
def test_a_quarter_of_a_period_is_still_one_instant(late_s: float, is_pair: bool):
    found = begun()
    found.push(0, 1.0, "a")
    outcome = found.push(1, 1.0 + PERIOD_S / 4.0 + late_s, "b")
    if is_pair:
        assert outcome.groups == [("a", "b")]
        assert (outcome.drops, found.last_rejected_s) == ([], None)
        return
    assert outcome.groups == []
    assert outcome.drops == [Drop(0, "a", "skew"), Drop(1, "b", "skew")]
    assert found.last_rejected_s == PERIOD_S / 4.0 + EPS_S
    assert found.dropped == {(0, "skew"): 1, (1, "skew"): 1}


@pytest.mark.parametrize(("skew_s", "pairs"), [(EPS_S, 1), (2.0 * EPS_S, 0)])
def test_the_profile_allows_its_own_skew_and_no_more(skew_s: float, pairs: int):
    found = begun(max_skew_s=EPS_S)
    assert found.limit_s == EPS_S
    found.push(0, 1.0, "a")
    assert len(found.push(1, 1.0 + skew_s, "b").groups) == pairs


def test_a_scene_that_stands_still_takes_any_frame_within_half_a_period():
    found = begun(is_static=True, max_skew_s=PERIOD_S)
    assert found.limit_s == PERIOD_S
    found.push(0, 1.0, "a")
    assert found.push(1, 1.0 + PERIOD_S / 2.0, "b").groups == [("a", "b")]
    found.push(0, 2.0, "a")
    outcome = found.push(1, 2.0 + PERIOD_S / 2.0 + EPS_S, "b")
    assert outcome.groups == []
    assert outcome.drops == [Drop(0, "a", "unpaired")]


@pytest.mark.parametrize(("early_s", "is_decided"), [(0.0, True), (EPS_S, False)])
def test_an_older_frame_is_a_partner_at_once_where_no_nearer_can_come(
    early_s: float, is_decided: bool
):
    found = begun()
    found.push(1, 1.0 - PERIOD_S / 4.0 - early_s, "b")
    outcome = found.push(0, 1.0, "a")
    assert outcome.groups == ([("a", "b")] if is_decided else [])
    assert outcome.drops == []


def test_a_frame_that_waited_in_vain_goes_when_a_nearer_one_comes():
    found = begun()
    found.push(1, 1.0 - PERIOD_S / 4.0 - EPS_S, "early")
    found.push(0, 1.0, "a")
    outcome = found.push(1, 1.0 + EPS_S, "b")
    assert outcome.groups == [("a", "b")]
    assert outcome.drops == [Drop(1, "early", "unpaired")]


def test_an_exact_frame_is_taken_at_once():
    found = begun()
    found.push(1, 1.0, "b")
    assert found.push(0, 1.0, "a").groups == [("a", "b")]


@pytest.mark.parametrize(
    ("early_s", "drops"),
    [
        (PERIOD_S / 2.0, [Drop(0, "a", "skew"), Drop(1, "b", "skew")]),
        (PERIOD_S / 2.0 + EPS_S, [Drop(0, "a", "lead-in")]),
    ],
)
def test_the_lead_in_ends_half_a_period_before_the_last_camera_began(
    early_s: float, drops: list[Drop[str]]
):
    found = pairing()
    assert found.push(0, 1.0 - early_s, "a").drops == []
    assert found.push(1, 1.0, "b").drops == drops


@pytest.mark.parametrize(("is_begun", "reason"), [(True, "unpaired"), (False, "lead-in")])
def test_sixteen_frames_of_a_camera_wait_and_the_seventeenth_ends_the_first(
    is_begun: bool, reason: str
):
    found = begun() if is_begun else pairing()
    drops = [found.push(0, 1.0 + PERIOD_S * number, f"a{number}").drops for number in range(18)]
    assert drops[:16] == [[]] * 16
    assert drops[16:] == [[Drop(0, "a0", reason)], [Drop(0, "a1", reason)]]


def test_time_must_grow():
    found = pairing(1)
    assert found.push(0, 1.0, "a").groups == [("a",)]
    assert found.push(0, 1.0, "b").drops == [Drop(0, "b", "order")]
    assert found.push(0, 0.5, "c").drops == [Drop(0, "c", "order")]
    assert found.push(0, 1.0 + EPS_S, "d").groups == [("d",)]
    assert found.dropped == {(0, "order"): 2}


def run(found: Pairing[str], camera: int, start_s: float, steps_s: list[float]) -> float:
    for step_s in steps_s:
        start_s += step_s
        found.push(camera, start_s, "it")
    return start_s


def test_a_camera_is_known_to_be_faster_after_nine_intervals():
    found = pairing(1)
    at_s = run(found, 0, 0.0, [1.0, *[PERIOD_S / 2.0] * 8])
    assert found.limit_s == PERIOD_S / 4.0
    run(found, 0, at_s, [PERIOD_S / 2.0])
    assert found.limit_s == PERIOD_S / 8.0


def test_the_middle_one_of_the_last_nine_intervals_counts():
    found = pairing(1)
    at_s = run(found, 0, 0.0, [1.0, *[PERIOD_S] * 20, *[PERIOD_S / 2.0] * 4])
    assert found.limit_s == PERIOD_S / 4.0
    at_s = run(found, 0, at_s, [PERIOD_S / 2.0])
    assert found.limit_s == PERIOD_S / 8.0
    at_s = run(found, 0, at_s, [9.0, 9.0, 9.0, PERIOD_S])
    assert found.limit_s == PERIOD_S / 8.0
    run(found, 0, at_s, [PERIOD_S])
    assert found.limit_s == PERIOD_S / 4.0


@pytest.mark.parametrize(
    ("share", "judged_by"), [(0.75, 0.75), (0.8125, 1.0), (1.0, 1.0), (1.5, 1.0), (4.0, 1.0)]
)
def test_pairs_are_judged_by_a_measured_period_that_is_clearly_shorter_only(
    share: float, judged_by: float
):
    found = pairing(1)
    run(found, 0, 0.0, [share * PERIOD_S] * 12)
    assert found.limit_s == judged_by * PERIOD_S / 4.0


def test_frames_of_a_faster_camera_between_two_instants_are_one_too_many():
    found = begun()
    for number, after_s in enumerate((1.0, 1.0 + PERIOD_S / 2.0, 1.0 + PERIOD_S)):
        found.push(1, after_s, f"b{number + 1}")
    assert found.push(0, 1.0, "a1").groups == [("a1", "b1")]
    outcome = found.push(0, 1.0 + PERIOD_S, "a2")
    assert outcome.groups == [("a2", "b3")]
    assert outcome.drops == [Drop(1, "b2", "unpaired")]


def test_a_lost_frame_of_one_camera_costs_the_frame_of_the_other_alone():
    found = begun()
    assert found.push(0, 1.0, "a1").drops == []
    assert found.push(0, 1.0 + PERIOD_S, "a2").drops == []
    outcome = found.push(1, 1.0 + PERIOD_S, "b2")
    assert outcome.drops == [Drop(0, "a1", "unpaired")]
    assert outcome.groups == [("a2", "b2")]


def test_three_cameras_are_as_far_apart_as_their_first_and_last():
    found = pairing(3)
    step_s = PERIOD_S / 8.0
    found.push(0, 1.0, "a")
    found.push(1, 1.0 - step_s, "b")
    assert found.push(2, 1.0 + step_s, "c").groups == [("a", "b", "c")]
    found.push(0, 2.0, "a")
    found.push(1, 2.0 - step_s, "b")
    assert found.push(2, 2.0 + step_s + EPS_S, "c").groups == []
    assert found.last_rejected_s == 2.0 * step_s + EPS_S
