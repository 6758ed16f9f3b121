"""Fly one command with the gains as they are, then with each change of one; print what the change does.

.venv/bin/python docs/tutorial/gains.py Kvcorr=1 Dangle=0.4     (in a terminal in which devel/setup.bash is sourced)
"""

import argparse
import math
import sys

from drone_sim.mechanics.frames import to_euler
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.offline.fly import settings
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

BEGIN, STOP, END = 1.0, 7.0, 24.0  # s; begin and stop are those of stages 4 and 5
HEIGHT = 10.0  # m, to have room
COLUMNS = ("too fast by", "90 % after", "leans", "sags", "swings back", "propellers")


def main(arguments=None):
    """Print a line for the gains as they are, and one for each change; return the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not 0 < options.speed <= 20:
        parser.error(f"--speed {options.speed:g}: must be above 0 and at most 20 m/s")
    always = ["control.thrust_limits=null", f"drone.position=[0, 0, {HEIGHT}]"]
    print("".join([f"{'gain':>14}", *(f"{title:>13}" for title in COLUMNS)]))
    for change in ("as it is", *options.changes):
        try:
            changed = [] if change == "as it is" else [f"control.{change}"]
            values = parameters.load(settings([*changed, *always]))
        except parameters.ParameterError as error:
            print(f"gains.py: {error}", file=sys.stderr)
            return 1
        print(f"{change:>14}{_told(_fly(values, options), options.speed)}")
    return 0


def _fly(values, options):
    """Return time, speed along the command, lean towards it, height and propellers after each step."""
    command = Twist(Vector3(0, options.speed, 0) if options.left else Vector3(options.speed, 0, 0))
    simulation = Simulation(values)
    flown = []
    for step in range(round(END / values.time_step)):
        time = step * values.time_step
        if BEGIN <= time < BEGIN + values.time_step:
            simulation.drone.commands.receive(command)
        elif STOP <= time < STOP + values.time_step:
            simulation.drone.commands.receive(Twist())
        simulation.step()
        state, lean = simulation.drone.body.state, to_euler(simulation.drone.body.matrix)
        along = state.linear_velocity[1 if options.left else 0]
        towards = -lean[0] if options.left else lean[1]
        flown.append((time, along, towards, state.position[2], simulation.drone.propulsion.particle_velocities))
    simulation.close()
    return flown


def _told(flown, speed):
    if max(abs(lean) for _, _, lean, _, _ in flown) > math.pi / 2:
        return f"{'tumbles':>13}"
    fast = max(along for time, along, *_ in flown if time < STOP)
    there = next((time - BEGIN for time, along, *_ in flown if along > 0.9 * speed), math.nan)
    lean = max(lean for time, _, lean, _, _ in flown if time < STOP)
    sag = HEIGHT - min(row[3] for row in flown)
    back = -min(row[1] for row in flown)
    blown = [velocity for row in flown for velocity in row[4]]
    flight = f"{fast / speed - 1:.0%}", f"{there:.2f} s", f"{lean:.2f} rad", f"{sag:.2f} m", f"{back:.2f} m/s"
    return "".join(f"{cell:>13}" for cell in (*flight, f"{min(blown):.1f} .. {max(blown):.1f}"))


def _parser():
    parser = argparse.ArgumentParser(description="Fly a command with other gains, and print what they change.")
    parser.add_argument("changes", nargs="*", help="such as Kvcorr=1; the names are those of `control` in drone.yaml")
    parser.add_argument("--speed", type=float, default=1.0, metavar="M/S", help="of the command (default: 1)")
    parser.add_argument("--left", action="store_true", help="fly to the left (roll) rather than forward (pitch)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
