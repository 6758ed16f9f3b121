"""What counts in a flight: one file for every kind of criterion. A kind that `criteria:` may name has its line here."""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.grading.criteria.no_contact import NoContact
from drone_sim.grading.criteria.rise_time import RiseTime

KINDS = (
    RiseTime,
    NoContact,
)
AnyCriterion = one_of(*KINDS)
