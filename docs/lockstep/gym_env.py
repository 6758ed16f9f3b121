"""A Gymnasium environment on the simulation, without ROS: fly to a goal that each seed puts elsewhere."""

import gymnasium
import numpy as np

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation


class FlyTo(gymnasium.Env):
    """Observation: the way to the goal (m) and the velocity (m/s). Action: the velocity that is commanded (m/s)."""

    observation_space = gymnasium.spaces.Box(-1000, 1000, (6,), np.float64)
    action_space = gymnasium.spaces.Box(-1, 1, (3,), np.float64)

    def __init__(self, **changes):
        """Take keys of config/drone.yaml."""
        self.simulation = Simulation(parameters.load(changes))

    def reset(self, *, seed=None, options=None):
        """Begin again at time 0."""
        super().reset(seed=seed)
        self.goal = self.np_random.uniform([0.5, -1, 1], [2, 1, 2])
        self.simulation.stop()
        self.simulation.start()
        return self._observation(), {}

    def step(self, action):
        """Fly for 0.05 s."""
        self.simulation.drone.commands.receive(Twist(linear=Vector3(*map(float, action))))
        self.simulation.step()
        observation = self._observation()
        distance = float(np.linalg.norm(observation[:3]))
        return observation, -distance, distance < 0.1, self.simulation.time > 20, {}

    def _observation(self):
        state = self.simulation.drone.body.state
        return np.array([*(self.goal - state.position), *state.linear_velocity])

    def close(self):
        """Free the world."""
        self.simulation.close()
