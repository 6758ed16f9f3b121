"""Flights that grade themselves: a plan says what happens and what counts, a script flies it, a result says how well.

Knows no ROS. `plan.read` reads a plan, `flight.grade` flies it once and returns a `result.Result`.
"""
