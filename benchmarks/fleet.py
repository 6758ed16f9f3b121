"""Several drones in one world: time against their number, in the loop and in fleet.launch with all cameras heard."""

import sys
import time
from typing import Any

from benchmarks import node
from benchmarks.cores import one_core
from benchmarks.loop import race
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

Row = dict[str, Any]
NUMBERS = (1, 2, 4, 8, 16, 32, 64)
HEARD = 4  # drones whose front cameras are listened to


def _simulation(number: int, cameras: bool = False) -> Simulation:
    """Return so many drones, spread out; with `cameras`, somebody looks at what every front camera sees."""
    simulation = Simulation(parameters.load({"vehicles": number}))
    for vehicle in simulation.vehicles.values():
        vehicle.cameras["front"].viewers.add(lambda: cameras)
    return simulation


def in_the_loop(rounds: int = 5, seconds: float = 0.4) -> list[Row]:
    """Without ROS, on one core: simulated seconds per second, and what a step of one of the drones costs."""
    with one_core():
        flown = {f"{number} drone{'s' if number > 1 else ''}, no camera": number for number in NUMBERS}
        simulations = {name: _simulation(number) for name, number in flown.items()}
        name = f"{HEARD} drones, {HEARD} front cameras"
        simulations[name], flown[name] = _simulation(HEARD, cameras=True), HEARD
        rows = race({name: one.step for name, one in simulations.items()}, rounds, seconds)
    for simulation in simulations.values():
        simulation.close()
    return [
        {
            "name": row["name"],
            "factor": row["factor"],
            "step_us": row["step_us"],
            "a_drone_us": row["step_us"] / flown[row["name"]],
        }
        for row in rows
    ]


def in_the_node(seconds: float = 20.0) -> list[Row]:
    """fleet.launch at real time, on all cores, with every front camera heard: late steps, and the rate of pictures."""
    import rospy
    from sensor_msgs.msg import Image

    with node.master():
        rospy.init_node("benchmark", disable_signals=True)
        print(f"  fleet.launch, {HEARD} front cameras, for {seconds:g} s of real time", file=sys.stderr, flush=True)
        came: list[float] = []
        with node.launched(f"n:={HEARD}", "rviz:=false", file="fleet.launch") as lines:
            heard = [
                node.listen(f"/drone{number}/front", Image, lambda _: came.append(time.monotonic()))
                for number in range(1, HEARD + 1)
            ]
            time.sleep(2.0)  # until all are connected
            del came[:]
            time.sleep(seconds)
            pictures = len(came) / seconds / HEARD
            for subscriber in heard:
                subscriber.unregister()
        rospy.signal_shutdown("done")
    if not came:
        raise RuntimeError("no picture came")
    flew = node.flew(lines)
    return [
        {
            "name": f"fleet.launch n:={HEARD}, {HEARD} front cameras heard",
            "pictures_hz": pictures,
            "late_steps": int(flew.group(3)),
            "worst_ms": float(flew.group(4)),
        }
    ]


def measure() -> list[Row]:
    """Return all rows."""
    return in_the_loop() + in_the_node()
