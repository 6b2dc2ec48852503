"""Owners on a real PostgreSQL server: two benches that share a database."""

from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, timedelta
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.orm import Session

from rig.database import Store, open_store
from rig.database.leases import STALE_S, sweep_lease
from rig.database.tables import LeaseRow
from rig.errors import OwnedError
from tests.support.multiviews import noisy_multiview
from tests.support.postgresql import postgresql_server
from tests.support.stores import STOPS, new_sweep

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with postgresql_server() as address:
        yield address


@pytest.fixture
def benches(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Store, Store]]:
    monkeypatch.setenv("RIG_FRAMES", str(tmp_path))
    with open_store(url) as one, open_store(url) as other:
        yield one, other


def add(store: Store, sweep_id: int, stop: int) -> None:
    store.add_sample(sweep_id, stop=stop, number=0, reached_mm=1.0, multiview=noisy_multiview(stop))


def test_one_bench_works_and_the_other_waits(benches: tuple[Store, Store]):
    one, other = benches
    sweep_id = new_sweep(one, samples_per_stop=1)
    with one.owned_sweep(sweep_id, "asked"):
        add(one, sweep_id, 0)
        with pytest.raises(OwnedError, match="asked to resume it, it belongs to process"):
            ExitStack().enter_context(other.owned_sweep(sweep_id, "asked to resume it"))
        with pytest.raises(OwnedError):
            add(other, sweep_id, 1)
    with other.owned_sweep(sweep_id, "asked"):
        for stop in STOPS[1:]:
            add(other, sweep_id, stop.index)
        assert one.sweep(sweep_id).state == "taken"
        other.save_curve(sweep_id, curve={}, holdout={}, versions={})
    assert one.sweep(sweep_id).state == "concluded"
    assert one.owners() == {}


def test_another_machine_is_judged_by_the_clock_of_the_server(
    benches: tuple[Store, Store], url: str
):
    one, other = benches
    lease = sweep_lease(new_sweep(one))
    engine = create_engine(url)
    for silent_s, is_dead in ((STALE_S - 60.0, False), (STALE_S + 1.0, True)):
        with Session(engine) as session, session.begin():
            now = session.scalars(text("SELECT clock_timestamp()")).one()
            heard = now.astimezone(UTC) - timedelta(seconds=silent_s)
            session.merge(
                LeaseRow(
                    what=lease,
                    token="e" * 32,
                    host="bench-2",
                    pid=4711,
                    process="another-boot 1 99",
                    since=heard,
                    heartbeat=heard,
                )
            )
        owner = other.owner(lease)
        assert (owner is None) == is_dead
        assert owner is None or (owner.host, owner.pid) == ("bench-2", 4711)
    engine.dispose()
