"""Fly through weather and faults, and draw what happened beside what theory says: the plots of docs/weather.md.

.venv/bin/python docs/draw_weather.py [FOLDER]; needs neither ROS nor a display. What it prints is what the page quotes.
"""

import math
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure

from drone_sim.forces.weather import Weather
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.types import QUADRICOPTER

DOCS = Path(__file__).resolve().parent
BLUE, ORANGE, GREEN, RED, GREY = "#1f5fa8", "#d9730d", "#2c8a57", "#a8325e", "#707070"
THEORY = {"color": "black", "linestyle": "--", "linewidth": 1.2}
ABOVE = {"loc": "lower right", "bbox_to_anchor": (1, 1), "ncol": 3, "fontsize": "small", "frameon": False}
STEP, SUB_STEPS = 0.05, 10  # s
DRAG, GRAVITY = 0.1, 9.81  # kg/s, m/s²
PANGLE, DANGLE, KVCORR = 0.3, 0.2, 0.5  # the gains of config/drone.yaml
GUSTY = {"wind": [4.0, 0.0, 0.0], "gusts": {"deviation": [3.0, 3.0, 1.5]}}
WIFI = {"latency": 0.2, "jitter": 0.1, "loss": 0.2}
COME = {0.15: 0.25, 0.20: 0.5, 0.25: 0.75}  # share of what is not lost that has come after these s; all after 0.3 s


def main():
    """Draw every plot."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in (("gusts", gusts), ("propeller", propeller), ("link", link)):
        figure = Figure(figsize=(13, 6.5), layout="constrained")
        draw(figure, figure.add_gridspec(2, 2))
        figure.savefig(folder / f"weather_{name}.png", dpi=110)


def panel(figure, place, title, x="simulated time [s]", y=""):
    """Return axes with a title and labels."""
    axes = figure.add_subplot(place)
    axes.set_title(title, loc="left", fontweight="bold")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="#e4e4e4")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    return axes


def say(what, flown, theory, unit):
    """Print a number beside its theory."""
    print(f"{what}: {flown:.3f}, theory {theory:.3f} {unit}")


# ---- gusts


def gusts(figure, grid):
    """Draw a minute of gusts, the drone in them, and their spectrum over eight hours."""
    times, winds, speeds, drone = _flown_in_gusts(1200)
    upper = panel(figure, grid[0, 0], "Wind at the drone", y="[m/s]")
    for winds_along, color, label in zip(winds.T, (BLUE, ORANGE, GREEN), ("along", "across", "up")):
        upper.plot(times, winds_along, color=color, label=label)
    upper.legend(**ABOVE)
    lower = panel(figure, grid[1, 0], "How it is blown away", y="along the wind [m/s]")
    lower.plot(times, speeds, color=BLUE, label="flown")
    expected = _speed_in(winds[:, 0], drone)
    lower.plot(times, expected, **THEORY, label="theory: the loop, linear")
    lower.legend(**ABOVE)
    say("mean speed in gusts", speeds[100:].mean(), expected[100:].mean(), "m/s")
    say("its deviation", speeds[100:].std(), expected[100:].std(), "m/s")
    _draw_spectra(panel(figure, grid[:, 1], "Spectra of the gusts", "frequency [Hz]", "power [(m/s)²/Hz]"))


def _flown_in_gusts(steps):
    sensors = {"wind": {"kind": "wind", "rate": 20}}
    simulation = Simulation(parameters.load({"weather": GUSTY, "sensors": sensors}))
    winds, speeds = [], []
    for _ in range(steps):
        simulation.step()
        winds.append(simulation.drone.instruments.by_name["wind"].readings[-1].value)
        speeds.append(simulation.drone.body.state.linear_velocity[0])
    simulation.close()
    return np.arange(1, steps + 1) * STEP, np.array(winds), np.array(speeds), simulation.drone


def _speed_in(wind, drone):
    """Return the speed of the same loop, linear and in one dimension.

    m v' = c (w - v) - m g θ and I θ'' = M u, where the thrust keeps its direction through a step, and
    u = Pangle (Kvcorr v - θ) - Dangle θ' is what the controller has made of the step before.
    """
    body = drone.body
    levers = [abs(point[0]) for point in _points(drone)]
    turning = body.mass * GRAVITY / 4 * sum(levers) / body.rigid.inertia[1][1]  # M / I
    lean = before = turn = correction = speed = 0.0
    speeds = []
    for one in wind:
        pull = GRAVITY * lean
        for _ in range(SUB_STEPS):
            turn += turning * correction * STEP / SUB_STEPS
            lean += turn * STEP / SUB_STEPS
            speed += (DRAG / body.mass * (one - speed) - pull) * STEP / SUB_STEPS
        correction = PANGLE * (KVCORR * speed - lean) - DANGLE * (lean - before) / STEP
        before = lean
        speeds.append(speed)
    return np.array(speeds)


def _draw_spectra(axes):
    clock = SimpleNamespace(time=0.0)
    weather = Weather(parameters.load({"weather": GUSTY}).weather, clock)
    count, parts = 2**13, 70
    blown = np.empty((parts, count, 3))
    for place in np.ndindex(parts, count):
        blown[place] = weather.at((0.0, 0.0, 0.8))
        clock.time += STEP
    blown -= (4.0, 0.0, 0.0)
    window = np.hanning(count)[:, None]
    power = (np.abs(np.fft.rfft(blown * window, axis=1)) ** 2).mean(axis=0) * 2 * STEP / (window**2).sum()
    frequencies = np.fft.rfftfreq(count, STEP)
    axes.set(xlim=(4e-3, 10), ylim=(3e-4, 1e3))
    lengths = weather.now.gusts.length
    for number, (color, name) in enumerate(zip((BLUE, ORANGE, GREEN), ("along", "across", "up"))):
        deviation = weather.now.gusts.deviation[number]
        axes.loglog(frequencies[1:], power[1:, number], color=color, linewidth=1, label=name)
        theory = dryden(frequencies[1:] * 2 * math.pi / 4.0, deviation, lengths[number], number == 0)
        axes.loglog(frequencies[1:], theory * 2 * math.pi / 4.0, **THEORY, label="Dryden" if number == 2 else None)
        say(f"deviation {name}", blown[..., number].std(), deviation, "m/s")
    axes.legend(fontsize="small")


def dryden(wave_number, deviation, length, is_along):
    """Return the one-sided spectrum ((m/s)² per rad/m) of MIL-F-8785C over the wave number (rad/m)."""
    square = 1 + (length * wave_number) ** 2
    shape = 2 / square if is_along else (1 + 3 * (length * wave_number) ** 2) / square**2
    return deviation**2 * length / math.pi * shape


# ---- a propeller


def propeller(figure, grid):
    """Draw a propeller that stops at hover, and one that loses a tenth."""
    times, states, expected = _with_propeller(0.0, 70)
    rates = np.array([state.angular_velocity for state in states])
    axes = panel(figure, grid[0, 0], "Front left stops at 1 s: how it begins to turn", y="angular velocity [rad/s]")
    for number, (color, name) in enumerate(zip((BLUE, ORANGE, GREEN), "xyz")):
        axes.plot(times, rates[:, number], ".-", color=color, label=f"about {name}")
        axes.plot([1.0, 1.15], [0, expected[number] * 0.15], **THEORY)
    axes.set(xlim=(0.9, 1.5), ylim=(-5, 5))
    axes.legend(loc="upper left", ncol=3, fontsize="small")
    gained = (rates[21] - rates[20]) / STEP
    for name, flown, theory in zip("xyz", gained, expected):
        say(f"stopped, angular acceleration about {name}", flown, theory, "rad/s²")
    axes = panel(figure, grid[1, 0], "... and how it falls: no equilibrium is left", y="height [m]")
    axes.plot(times, [state.position[2] for state in states], color=BLUE)
    times, states, _ = _with_propeller(0.9, 400)
    _draw_a_tenth_less(figure, grid, times, states)


def _with_propeller(share, steps):
    """Return times, states, and the angular acceleration that theory expects when the front left one has a share."""
    simulation = Simulation(parameters.load({"drone": {"position": [0, 0, 5]}}))
    drone, states = simulation.drone, [simulation.drone.body.state]
    expected = np.zeros(3)
    for step in range(steps):
        if step == 20:
            drone.change_faults({"propellers": [share, 1, 1, 1]})
        simulation.step()
        states.append(drone.body.state)
        if step == 20:
            expected = np.linalg.solve(drone.body.rigid.inertia, _torque(drone))
    simulation.close()
    return np.arange(steps + 1) * STEP, states, expected


def _torque(drone):
    """Return the torque (N m, body) of the propellers: r × f of each, and its reaction."""
    torque = np.zeros(3)
    blown = zip(_points(drone), drone.body.thrusts, drone.faults.now.propellers, drone.propulsion.particle_velocities)
    for (_, sense), (point, thrust, share, velocity) in zip(QUADRICOPTER.rotors, blown):
        torque += np.cross(point, (0, 0, thrust))
        torque[2] += sense * 0.002 * share * velocity
    return torque


def _points(drone):
    """Return where the propellers push (m, inertial frame)."""
    from_root = drone.body.inertial_from_root
    return [frames.position(frames.multiply(from_root, link)) for link in drone.propulsion.rotors.links]


def _draw_a_tenth_less(figure, grid, times, states):
    # All four must blow alike: 1 + d = e (1 - 3d) with corrections d, so d = -(1 - e) / (1 + 3e).
    correction = 0.1 / 3.7
    turn = [state.angular_velocity[2] for state in states]
    speed = [math.hypot(*state.linear_velocity[:2]) for state in states]
    drift = math.sqrt(2) * correction / PANGLE / KVCORR
    for place, values, theory, title, unit in (
        (grid[0, 1], turn, correction, "It gives a tenth less: the drone turns ...", "yaw rate [rad/s]"),
        (grid[1, 1], speed, drift, "... and drifts, in a circle", "speed over ground [m/s]"),
    ):
        axes = panel(figure, place, title, y=unit)
        axes.plot(times, values, color=BLUE, label="flown")
        axes.axhline(theory, **THEORY, label="theory")
        axes.legend(loc="lower right", fontsize="small")
        say(title, values[-1], theory, unit)


# ---- a link


def link(figure, grid):
    """Draw commands over a bad link: a bit of them, how old those in force are, and what becomes of the flight."""
    period, seconds = 6.0, 240
    sent, _, _, direct = _swing(period, seconds, {})
    _, obeyed, ages, flown = _swing(period, seconds, {"commands": WIFI})
    times = np.arange(1, len(sent) + 1) * STEP
    axes = panel(figure, grid[0, 0], "Commands at 10 Hz over 200 ± 100 ms, one in five lost", y="forward [m/s]")
    axes.step(times, sent, where="pre", color=GREY, label="sent")
    axes.step(times, obeyed, where="pre", color=ORANGE, label="in force")
    axes.set_xlim(12, 18)
    axes.legend(loc="upper right", fontsize="small")
    axes = panel(figure, grid[1, 0], "What becomes of them", y="forward [m/s]")
    axes.plot(times, direct, color=GREY, label="flown without the link")
    axes.plot(times, flown, color=BLUE, label="flown over it")
    axes.set_xlim(12, 18)
    axes.legend(loc="upper right", fontsize="small")
    _draw_ages(
        panel(figure, grid[:, 1], "How old the command in force is", "age [s]", "share of the steps"), ages[200:]
    )
    turning = 2 * math.pi / period
    late = [_lag(one[200:], turning) for one in (flown, direct)]
    expected = _delay(ages_in_force(), turning) - _delay({0.0: 0.5, STEP: 0.5}, turning)
    say("lag of the flight behind that without the link", (late[0] - late[1]) % period, expected, "s")


def _swing(period, seconds, faults):
    """Return in each step the last command sent, that in force, its age (s), and the speed (m/s), all along x."""
    simulation = Simulation(parameters.load({"faults": faults}))
    drone, rows, times = simulation.drone, [], {0.0: 0}
    for step in range(round(seconds / STEP)):
        if step % 2 == 0:
            sent = 0.4 * math.sin(2 * math.pi * step * STEP / period) + 1e-6 * step  # no two of them are the same
            drone.commands.receive(Twist(Vector3(sent)))
            times[sent] = step
        simulation.step()
        obeyed = drone.commands.now.linear.x
        rows.append((sent, obeyed, (step - times[obeyed]) * STEP, drone.body.state.linear_velocity[0]))
    simulation.close()
    return np.array(rows).T


def ages_in_force():
    """Return the share of the steps in which the command in force has each age (s), by theory.

    It is the newest that has come. One sent so long ago has come with the probability 0.8 F(age), F of COME; those
    sent after it have not. There is one for each 0.1 s; every other step is 0.05 s after the last was sent.
    """
    shares = {}
    for first in (0, 1):
        left = 0.5
        for steps in range(first, 60, 2):
            age = round(steps * STEP, 2)
            come = (1 - WIFI["loss"]) * COME.get(age, 1.0 if age > 0.25 else 0.0)
            shares[age] = left * come
            left *= 1 - come
    return shares


def _draw_ages(axes, ages):
    theory = {age: share for age, share in ages_in_force().items() if share > 1e-4}
    axes.bar(list(theory), [np.mean(np.isclose(ages, age)) for age in theory], width=0.035, color=BLUE, label="flown")
    for age, share in theory.items():
        axes.plot([age - 0.022, age + 0.022], [share, share], **THEORY, label="theory" if age == 0.3 else None)
    axes.legend(fontsize="small")
    say("mean age of the command in force", ages.mean(), sum(age * share for age, share in theory.items()), "s")


def _delay(ages, turning):
    """Return by how much (s) a swing is late of which one sees values of these ages, each in its share of the time."""
    return -np.angle(sum(share * np.exp(-1j * turning * age) for age, share in ages.items())) / turning


def _lag(speeds, turning):
    """Return by how much (s) a swing comes late."""
    times = np.arange(len(speeds)) * STEP
    columns = [np.sin(turning * times), np.cos(turning * times), np.ones_like(times), times]
    sine, cosine, *_ = np.linalg.lstsq(np.column_stack(columns), speeds, rcond=None)[0]
    return -math.atan2(cosine, sine) / turning


if __name__ == "__main__":
    main()
