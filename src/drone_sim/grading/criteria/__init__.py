"""What counts in a flight: one file for every kind of criterion. A kind that `criteria:` may name has its line here."""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.grading.criteria.attitude import Attitude
from drone_sim.grading.criteria.drift import Drift
from drone_sim.grading.criteria.formation import Formation
from drone_sim.grading.criteria.landed import Landed
from drone_sim.grading.criteria.no_contact import NoContact
from drone_sim.grading.criteria.overshoot import Overshoot
from drone_sim.grading.criteria.path import PathFollowing
from drone_sim.grading.criteria.reach import Reach
from drone_sim.grading.criteria.rise_time import RiseTime
from drone_sim.grading.criteria.settling_time import SettlingTime
from drone_sim.grading.criteria.signal import Signal
from drone_sim.grading.criteria.stays import Stays
from drone_sim.grading.criteria.steady_error import SteadyError

KINDS = (
    RiseTime,
    Overshoot,
    SettlingTime,
    SteadyError,
    Stays,
    Attitude,
    Drift,
    Reach,
    PathFollowing,
    Formation,
    Landed,
    NoContact,
    Signal,
)
AnyCriterion = one_of(*KINDS)
