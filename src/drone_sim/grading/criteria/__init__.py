"""The criteria of a plan. `KINDS` lists every kind that `criteria:` may name."""

from __future__ import annotations

from drone_sim.config.types import one_of
from drone_sim.grading.criteria.columns import Attitude, Overshoot, RiseTime, SettlingTime, Stays, SteadyError
from drone_sim.grading.criteria.contacts import Landed, NoContact
from drone_sim.grading.criteria.distances import Drift, Formation, PathFollowing, Reach
from drone_sim.grading.criteria.signal import Signal

KINDS = (
    *(RiseTime, Overshoot, SettlingTime, SteadyError),
    *(Stays, Attitude, Drift, Reach, PathFollowing, Formation),
    *(Landed, NoContact, Signal),
)
AnyCriterion = one_of(*KINDS)
