"""The criteria of a plan. `KINDS` lists every kind that `criteria:` may name."""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.grading.criteria.columns import Attitude, Stays, SteadyError
from drone_sim.grading.criteria.contacts import Landed, NoContact
from drone_sim.grading.criteria.distances import Drift, Formation, PathFollowing
from drone_sim.grading.criteria.reach import Reach
from drone_sim.grading.criteria.signal import Signal
from drone_sim.grading.criteria.step_response import Overshoot, RiseTime, SettlingTime

KINDS = (
    *(RiseTime, Overshoot, SettlingTime, SteadyError),
    *(Stays, Attitude, Drift, Reach, PathFollowing, Formation),
    *(Landed, NoContact, Signal),
)
AnyCriterion = one_of(*KINDS)
