"""All verbs of the campaign, by name."""

from collections.abc import Callable

from benchmarks.kills.copying import BackupTrial, MigrateTrial
from benchmarks.kills.looking import (
    CheckTrial,
    HistoryTrial,
    PruneTrial,
    ReportTrial,
    RestoreTrial,
    VerifyTrial,
)
from benchmarks.kills.scanning import ScanTrial, SweepScanTrial
from benchmarks.kills.taking import CalibrateTrial, CaptureTrial, FitTrial, SweepTrial
from benchmarks.kills.trial import Trial

VERBS: dict[str, Callable[[str | None], Trial]] = {
    trial.verb: trial
    for trial in (
        *(SweepTrial, FitTrial, CalibrateTrial, CaptureTrial, ScanTrial, BackupTrial, MigrateTrial),
        SweepScanTrial,
        *(CheckTrial, HistoryTrial, PruneTrial, ReportTrial, RestoreTrial, VerifyTrial),
    )
}
