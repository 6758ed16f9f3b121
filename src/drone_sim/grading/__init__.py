"""Graded flights without ROS: `plan.read` reads a plan, `flight.grade` flies it and returns a `result.Result`."""
