"""The mechanics of a simulated stage: what it carries does when the motor turns."""

import bisect
import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass

from rig.devices import Clock
from rig.profile.world import MechanicsConfig
from rig_sim.motion import Phase

KEPT_PHASES = 1000
"""How much of the past can be looked up."""
RING_DECAYS = 20.0
"""After so many decay times an oscillation is over (2e-9 of its amplitude)."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    """One phase of the rotor, and where the carriage was within its play when it began."""

    rotor: Phase
    carriage_mm: float

    def carriage_at(self, t_s: float, play_mm: float) -> float:
        """The rotor pushes the carriage outwards at once and pulls it back after the play."""
        rotor_mm = self.rotor.position_mm(t_s)
        return min(max(self.carriage_mm, rotor_mm), rotor_mm + play_mm)


@dataclass(frozen=True, slots=True)
class _Track:
    """Everything that has happened and is planned, as one value: readers need no lock."""

    stretches: tuple[_Stretch, ...]
    rings: tuple[tuple[float, float], ...]
    """Time and signed amplitude (mm) of every stop."""

    def at(self, t_s: float) -> _Stretch:
        """Return the stretch that holds at `t_s`; before the first, the first."""
        after = bisect.bisect_right(self.stretches, t_s, key=lambda s: s.rotor.start_s)
        return self.stretches[max(0, after - 1)]


class Carriage:
    """Board, spindle and reference switch of a linear stage.

    The carriage lies on the rotor's position or up to `backlash_mm` above it: moving towards
    larger machine coordinates it follows the motor exactly, moving back it lags behind by the
    play. Every stop makes it ring. The reference switch closes at machine coordinate 0.
    """

    def __init__(self, config: MechanicsConfig, clock: Clock) -> None:
        self._config = config
        self._clock = clock
        self._write = threading.Lock()
        self._slip_mm = 0.0
        rest = Phase(clock.now_s(), clock.now_s(), config.power_up_mm, 0.0, 0.0)
        self._track = _Track((_Stretch(rest, config.power_up_mm),), ())

    @property
    def power_up_mm(self) -> float:
        """Machine coordinate at which the motor stood when power came."""
        return self._config.power_up_mm

    def travelled_mm(self, t_s: float) -> float:
        """Return the true displacement of what it carries from machine zero along the axis."""
        track = self._track
        carriage_mm = track.at(t_s).carriage_at(t_s, self._config.backlash_mm)
        return self._config.scale * (carriage_mm + self._ringing_mm(track, t_s))

    def follow(self, phases: Sequence[Phase]) -> None:
        """Let the motor turn as planned; replaces what was planned after the first start.

        Args:
            phases: in motor machine coordinates, in order of time.
        """
        with self._write:
            for phase in phases:
                self._append(phase.mapped(scale=1.0, shift_mm=self._slip_mm))

    def halt(self, t_s: float, *, slips: bool = False) -> None:
        """Stop the motor dead at `t_s`.

        Args:
            t_s: when.
            slips: whether it loses steps over it, so that nobody knows where it stands.
        """
        with self._write:
            last = self._track.at(t_s).rotor.until(t_s)
            velocity_mm_s = last.end_velocity_mm_s
            slip_mm = 0.0
            if slips and velocity_mm_s != 0.0:
                slip_mm = math.copysign(self._config.slip_mm, velocity_mm_s)
            self._slip_mm += slip_mm
            self._append(Phase(t_s, t_s, last.end_mm + slip_mm, 0.0, 0.0))

    def switch_gap_mm(self) -> float:
        """Return how far the motor has still to go up until the switch closes; 0 if closed."""
        track = self._track
        stretch = track.stretches[-1]
        end_s = stretch.rotor.end_s
        if stretch.carriage_at(end_s, self._config.backlash_mm) >= 0.0:
            return 0.0
        return -stretch.rotor.end_mm

    @property
    def has_switch(self) -> bool:
        """Whether the reference switch works."""
        return self._config.has_switch

    def _append(self, rotor: Phase) -> None:
        """Cut the track at the start of a phase and add the phase; called with the lock held."""
        play_mm = self._config.backlash_mm
        track = self._track
        kept = [s for s in track.stretches if s.rotor.start_s < rotor.start_s]
        rings = tuple(ring for ring in track.rings if ring[0] <= rotor.start_s)
        if kept:
            last = kept[-1]
            begin_mm = last.carriage_at(rotor.start_s, play_mm)
            kept[-1] = _Stretch(last.rotor.until(rotor.start_s), last.carriage_mm)
        else:
            begin_mm = track.stretches[0].carriage_mm
        stretch = _Stretch(rotor, begin_mm)
        way_mm = stretch.carriage_at(rotor.end_s, play_mm) - begin_mm
        if abs(rotor.end_velocity_mm_s) < 1e-6 and way_mm != 0.0:
            amplitude_mm = math.copysign(min(self._config.ring_mm, abs(way_mm)), way_mm)
            rings = (*rings[-8:], (rotor.end_s, amplitude_mm))
        self._track = _Track((*kept[-KEPT_PHASES:], stretch), rings)

    def _ringing_mm(self, track: _Track, t_s: float) -> float:
        """Return the sum of the damped oscillations after the last stops."""
        decay_s = self._config.ring_decay_s
        total_mm = 0.0
        for stop_s, amplitude_mm in track.rings:
            passed_s = t_s - stop_s
            if 0.0 < passed_s < RING_DECAYS * decay_s:
                phase_rad = 2.0 * math.pi * self._config.ring_hz * passed_s
                total_mm += amplitude_mm * math.exp(-passed_s / decay_s) * math.sin(phase_rad)
        return total_mm
