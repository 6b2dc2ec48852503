"""The fault campaign of the serial stages, thinner than `python -m benchmarks.stage_faults`."""

import pytest
from rig_sim.wire.faults import HangUp

from benchmarks.stage_faults import STAGES, Tally, campaign, moments_of, sweep_with
from tests.support.wire_faults import ENDS_THE_DIALOGUE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("protocol", "kind"),
    [(name, kind) for name, subject in STAGES.items() for kind in subject.faults],
)
def test_a_sweep_survives_every_fault_or_says_so_and_goes_on(protocol: str, kind: str):
    tally = campaign(protocol, kind, moments=4, seed=2)
    assert tally.is_good, tally
    assert tally.struck > 0
    if kind in ENDS_THE_DIALOGUE:
        assert tally.finished <= tally.sweeps - tally.struck + 1, tally


@pytest.mark.parametrize("protocol", ["grbl", "zaber", "marlin", "two grbl"])
def test_a_cable_pulled_out_half_way_costs_nothing(protocol: str):
    tally = Tally()
    moments = moments_of(protocol, in_motion=True)
    sweep_with(protocol, HangUp(moments[len(moments) // 2]), tally)
    assert tally.told == {"DeviceLostError": 1}
    assert tally.is_good
