"""Draw the diagrams of docs/tutorial.md: loops, propellers, frames; needs neither ROS nor a display.

.venv/bin/python docs/draw_diagrams.py [FOLDER]
"""

import math
import sys
from pathlib import Path

from matplotlib import rcParams
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyBboxPatch, Polygon

DOCS = Path(__file__).resolve().parent
INK, GREY, LIGHT = "#222222", "#707070", "#f3f4f6"
COMMAND, MEASURED, GAIN = "#d9730d", "#2c8a57", "#1f5fa8"  # what is asked for; what is; the numbers that you choose
RED = "#a8325e"
DPI = 120
MINUS = "\N{MINUS SIGN}"

rcParams["mathtext.fontset"] = "dejavusans"


def main():
    """Draw every diagram."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    loops().savefig(folder / "tutorial_loops.png", dpi=DPI)
    propellers().savefig(folder / "tutorial_propellers.png", dpi=DPI)
    frames().savefig(folder / "tutorial_frames.png", dpi=DPI)


# ---- the pieces


def sheet(width, height, columns=1):
    """Return a figure of so many inches, and its axes, in which a unit is as long to the right as upwards."""
    figure = Figure(figsize=(width, height))
    panels = []
    for column in range(columns):
        axes = figure.add_axes((column / columns, 0, 1 / columns, 1))
        axes.set_aspect("equal")
        axes.axis("off")
        panels.append(axes)
    return figure, panels


def box(axes, x, y, width, height, text, **look):
    """Draw a labelled box around (x, y)."""
    style = {"facecolor": LIGHT, "edgecolor": INK, "linewidth": 1.3, **look}
    corner = x - width / 2, y - height / 2
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle="round,pad=0,rounding_size=0.9", zorder=2, **style))
    write(axes, x, y, text)


def write(axes, x, y, text, color=INK, size=11, **how):
    """Write a text, centred on (x, y)."""
    place = {"ha": "center", "va": "center", "zorder": 5, **how}
    axes.text(x, y, text, color=color, fontsize=size, **place)


def arrow(axes, start, end, color=INK, width=1.3, **how):
    """Draw an arrow."""
    style = {"arrowstyle": "-|>", "color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 13}
    axes.annotate("", end, start, arrowprops={**style, **how}, zorder=3)


def line(axes, *points, color=INK, width=1.3, **how):
    """Draw a line through the points."""
    axes.plot(*zip(*points), color=color, linewidth=width, solid_capstyle="round", **{"zorder": 1, **how})


# ---- the loops

SUM = 1.5  # radius of a circle that adds


def loops():
    """Return the block diagram: from the command through the four controllers to the drone, and back."""
    figure, (axes,) = sheet(11.5, 8.05)
    axes.set_xlim(0, 115)
    axes.set_ylim(0, 80.5)
    for y, height, name in ((67.1, 23.8, "elevation"), (49.1, 10.2, "yaw"), (36.2, 13, "pitch"), (20.7, 13, "roll")):
        axes.add_patch(
            FancyBboxPatch(
                (11.2, y - height / 2),
                65.3,
                height,
                boxstyle="round,pad=0,rounding_size=1",
                fc="#fafafa",
                ec="#d0d0d0",
                zorder=0,
            )
        )
        write(axes, 12.4, y + height / 2 - 1.9, name, GREY, 11, ha="left", style="italic")
    _tall(axes, 6, 5, "cmd_vel, or the flight plan", edgecolor=COMMAND)
    _elevation(axes)
    _yaw(axes)
    _lean(axes, 34.7, "x", "pitch")
    _lean(axes, 19.2, "y", "roll")
    _tall(axes, 85.9, 5, "mixing")
    _tall(axes, 97.1, 5, "propellers")
    _tall(axes, 110.5, 5, "dynamics")
    for y, number in ((66, 1), (52, 2), (38, 3), (24, 4)):
        arrow(axes, (88.4, y), (94.6, y))
        write(axes, 91.2, y + 1.9, f"$v_{number}$")
    for y, name in ((52, "force"), (38, "torque")):
        arrow(axes, (99.6, y), (108, y))
        write(axes, 103.5, y + 1.9, name, size=10.5)
    state = "state, measured in sensing, used in the next step:   $z$,  $v_z$,  yaw rate $\\omega_z$,  "
    box(axes, 57.5, 5, 111, 6, state + "speeds $v_x$, $v_y$ in Track_base,  pitch,  roll", edgecolor=MEASURED)
    arrow(axes, (110.5, 13), (110.5, 8), MEASURED)
    return figure


def _tall(axes, x, width, text, **look):
    box(axes, x, 45, width, 64, "", **look)
    write(axes, x, 45, text, size=12, rotation=90)


def _elevation(axes):
    hold, climb = 72, 61.4
    _sum(axes, 24, hold)
    arrow(axes, (17.6, hold), (24 - SUM, hold), COMMAND)
    write(axes, 15.6, hold, "$z_{ref}$", COMMAND)
    _measured(axes, 24, hold, "$z$")
    _gain(axes, 24 + SUM, 38 - SUM, hold, "Kzref")
    _sum(axes, 38, hold)
    _measured(axes, 38, hold, "$v_z$", "Dzref")
    _command(axes, 24, climb, "$v_z$")
    _sum(axes, 24, climb)
    _measured(axes, 24, climb, "$v_z$")
    line(axes, (24 + SUM, climb), (52, climb))
    write(axes, 38, climb + 1.7, "Dthrust", GAIN, weight="bold")
    # the switch
    line(axes, (38 + SUM, hold), (52, hold))
    for y in (hold, climb):
        axes.add_patch(Circle((52, y), 0.5, fc="white", ec=INK, zorder=4))
    write(axes, 50, hold + 2.1, "where $v_z$ asked is 0", GREY, 9, ha="center")
    write(axes, 46, climb - 2.3, "where it is not", GREY, 9)
    line(axes, (57, 66.7), (52.3, hold - 0.6), zorder=3)
    axes.add_patch(Circle((57, 66.7), 0.5, fc="white", ec=INK, zorder=4))
    arrow(axes, (57.5, 66.7), (65 - SUM, 66.7))
    _sum(axes, 65, 66.7)
    arrow(axes, (65, 72.2), (65, 66.7 + SUM), GAIN)
    write(axes, 65, 73.9, "thrust_gravity", GAIN, weight="bold")
    _out(axes, 65 + SUM, 66.7, "thrust")


def _yaw(axes):
    y = 50.4
    _command(axes, 24, y, "$\\omega_z$")
    _sum(axes, 24, y)
    _measured(axes, 24, y, "$\\omega_z$")
    write(axes, 31, y + 1.7, "Dyaw", GAIN, weight="bold")
    _out(axes, 24 + SUM, y, "yaw_corr")


def _lean(axes, y, speed, angle):
    y += 1.6
    _command(axes, 24, y, f"$v_{speed}$")
    _sum(axes, 24, y)
    _measured(axes, 24, y, f"$v_{speed}$")
    _gain(axes, 24 + SUM, 34, y, "Kvcorr")
    box(axes, 38, y, 8, 5, "")
    line(axes, (35, y - 1.5), (36.7, y - 1.5), (39.3, y + 1.5), (41, y + 1.5), zorder=4)
    write(axes, 38, y - 4.3, "angle_min, angle_max", GAIN, 9.5, weight="bold")
    arrow(axes, (42, y), (52 - SUM, y))
    write(axes, 46.3, y + 1.7, f"{angle}_target", size=9.5)
    _sum(axes, 52, y)
    _measured(axes, 52, y, angle)
    _gain(axes, 52 + SUM, 63 - SUM, y, "Pangle")
    _sum(axes, 63, y)
    _measured(axes, 63, y, "rate", "Dangle")
    _out(axes, 63 + SUM, y, f"{angle}_corr")


def _sum(axes, x, y):
    axes.add_patch(Circle((x, y), SUM, fc="white", ec=INK, linewidth=1.3, zorder=4))
    write(axes, x, y, "+", GREY, 11)


def _command(axes, x, y, text):
    arrow(axes, (8.5, y), (x - SUM, y), COMMAND)
    write(axes, 19.3, y + 1.8, text, COMMAND)


def _measured(axes, x, y, text, gain=""):
    """Draw what is subtracted at a sum, from below."""
    arrow(axes, (x, y - 4.2), (x, y - SUM), MEASURED)
    write(axes, x - 0.9, y - 2.6, MINUS, MEASURED, 12, ha="right")
    if gain:
        write(axes, x + 0.9, y - 3, gain, GAIN, ha="left", weight="bold")
    write(axes, x, y - 5.3, text, MEASURED, 11)


def _gain(axes, start, end, y, name):
    arrow(axes, (start, y), (end, y))
    write(axes, (start + end) / 2 - 0.3, y + 1.7, name, GAIN, weight="bold")


def _out(axes, x, y, name):
    arrow(axes, (x, y), (83.4, y))
    write(axes, 71.6, y + 1.7, name, size=10.5)


# ---- the propellers

ARM = 0.09192  # m, from the middle of the drone to a propeller's, along x and along y
RADIUS = 0.0796  # m
PROPELLERS = (  # number, name, place to the right and forward, whether clockwise from above, signs of pitch, roll, yaw
    (1, "front left", -1, 1, False, "---"),
    (2, "back left", -1, -1, True, "+-+"),
    (3, "back right", 1, -1, False, "++-"),
    (4, "front right", 1, 1, True, "-++"),
)


def propellers():
    """Return the drone from above: numbers, senses of rotation, signs of the corrections."""
    figure, (axes,) = sheet(8.4, 5.9)
    axes.set_xlim(-0.36, 0.36)
    axes.set_ylim(-0.262, 0.2437)
    reach = 0.75 * ARM
    line(axes, (-reach, -reach), (reach, reach), color=GREY, width=5, zorder=2)
    line(axes, (-reach, reach), (reach, -reach), color=GREY, width=5, zorder=2)
    axes.add_patch(
        FancyBboxPatch(
            (-0.013, -0.15), 0.026, 0.3, boxstyle="round,pad=0,rounding_size=0.01", fc="white", ec=INK, zorder=3
        )
    )
    axes.add_patch(Polygon([(-0.013, 0.135), (0.013, 0.135), (0, 0.162)], fc=RED, ec=RED, zorder=4))
    for number, name, right, forward, clockwise, signs in PROPELLERS:
        x, y = right * ARM, forward * ARM
        axes.add_patch(Circle((x, y), RADIUS, fc=LIGHT, ec=GREY, zorder=1))
        write(axes, x, y, str(number), size=22, weight="bold")
        _spin(axes, x, y, forward, clockwise)
        edge = right * (ARM + RADIUS + 0.014)
        side = "left" if right > 0 else "right"
        write(axes, edge, y + 0.052, name, size=12, weight="bold", ha=side)
        for row, (sign, what) in enumerate(zip(signs.replace("-", MINUS), ("pitch_corr", "roll_corr", "yaw_corr"))):
            color = (GAIN, COMMAND, MEASURED)[row]
            write(axes, edge, y + 0.018 - 0.032 * row, f"{sign} {what}", color, 12, ha=side, family="monospace")
    arrow(axes, (0, 0.165), (0, 0.225), RED, 2)
    write(axes, 0.012, 0.213, "$x$, forward", RED, 12, ha="left")
    arrow(axes, (-0.018, 0), (-0.075, 0), GREY, 2)
    write(axes, -0.083, 0, "$y$, left", GREY, 12, ha="right")
    for x in (0, ARM):
        line(axes, (x, -0.006), (x, 0.006), color=GREY, width=1, zorder=6)
    line(axes, (0, 0), (ARM, 0), color=GREY, width=1, zorder=6)
    write(axes, ARM + 0.012, 0, "0.0919 m", GREY, 12, ha="left")
    for place, color, text in (
        (-0.2, GAIN, "pitch_corr > 0:\nnose down"),
        (0, COMMAND, "roll_corr > 0:\nleans to the left"),
        (0.2, MEASURED, "yaw_corr > 0:\nturns to the left"),
    ):
        write(axes, place * 1.1, -0.228, text, color, 12)
    return figure


def _spin(axes, x, y, outer, clockwise):
    """Draw which way the blades turn, as seen from above, on the side away from the arms."""
    radius, middle = 0.058, 90 * outer
    end = middle + (-60 if clockwise else 60)
    axes.add_patch(
        Arc((x, y), 2 * radius, 2 * radius, theta1=middle - 60, theta2=middle + 60, color=INK, linewidth=1.6, zorder=3)
    )
    before, tip = (math.radians(end + (turn if clockwise else -turn)) for turn in (6, -7))
    arrow(axes, _on(x, y, radius, before), _on(x, y, radius * 0.97, tip), INK, 1.6)


def _on(x, y, radius, angle):
    return x + radius * math.cos(angle), y + radius * math.sin(angle)


# ---- the frames


def frames():
    """Return Track_base beside the body's frame, from the side (it stays level) and from above (it turns)."""
    figure, (side, above) = sheet(9.6, 4.4, columns=2)
    for axes, title in ((side, "from the side"), (above, "from above")):
        axes.set_xlim(-2.4, 2.4)
        axes.set_ylim(-1.95, 2.45)
        write(axes, 0, 2.2, title, GREY, 13, style="italic")
    _from_the_side(side)
    _from_above(above)
    return figure


def _from_the_side(axes):
    lean = -0.42  # rad, nose down
    along, up = (math.cos(lean), math.sin(lean)), (-math.sin(lean), math.cos(lean))

    def body(a, b):
        return a * along[0] + b * up[0], a * along[1] + b * up[1]

    line(axes, body(-0.85, 0), body(0.85, 0), color=GREY, width=6, zorder=2)
    for a in (-0.62, 0.62):
        line(axes, body(a, 0), body(a, 0.13), color=GREY, width=3, zorder=2)
        line(axes, body(a - 0.36, 0.14), body(a + 0.36, 0.14), color=INK, width=2, zorder=2)
    line(axes, body(0.72, 0), body(0.85, 0), color=RED, width=6, zorder=3)
    _axes(axes, (0, 0), body(1.75, 0), "$x$", body(0, 1.6), "$z$", RED)
    write(axes, 1.83, -1.14, "Quadricopter_base", RED, 11, ha="right")
    _axes(axes, (0, 0), (1.75, 0), "$x$", (0, 1.6), "$z$", GAIN)
    write(axes, 1.1, 0.2, "Track_base", GAIN, 11)
    axes.add_patch(Arc((0, 0), 2.6, 2.6, theta1=math.degrees(lean), theta2=0, color=MEASURED, linewidth=1.6))
    write(axes, 1.36, -0.28, "pitch", MEASURED, 11, ha="left")
    _axes(axes, (-2.1, -1.7), (-1.5, -1.7), "$x$", (-2.1, -1.1), "$z$", INK)
    write(axes, -1.62, -1.25, "world", INK, 11)
    line(axes, (-2.3, -1.7), (2.3, -1.7), color="#c0c0c0", width=1)


def _from_above(axes):
    yaw = 0.6
    cos, sin = math.cos(yaw), math.sin(yaw)

    def body(a, b):
        return a * cos - b * sin, a * sin + b * cos

    for right, forward in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        line(axes, (0, 0), body(0.55 * forward, 0.55 * right), color=GREY, width=4, zorder=2)
        axes.add_patch(Circle(body(0.55 * forward, 0.55 * right), 0.36, fc=LIGHT, ec=GREY, zorder=1))
    line(axes, body(-0.75, 0), body(0.75, 0), color=GREY, width=6, zorder=2)
    line(axes, body(0.63, 0), body(0.75, 0), color=RED, width=6, zorder=3)
    _axes(axes, (0, 0), body(1.8, 0), "$x$", body(0, 1.6), "$y$", GAIN)
    write(axes, *body(1.26, 0.17), "Track_base", GAIN, 11, rotation=math.degrees(yaw))
    line(axes, (0, 0), (1.8, 0), color=GREY, width=1, linestyle=(0, (4, 3)))
    axes.add_patch(Arc((0, 0), 2.9, 2.9, theta1=0, theta2=math.degrees(yaw), color=MEASURED, linewidth=1.6))
    write(axes, 1.5, 0.43, "yaw", MEASURED, 11, ha="left")
    _axes(axes, (-2.1, -1.7), (-1.5, -1.7), "$x$", (-2.1, -1.1), "$y$", INK)
    write(axes, -1.62, -1.25, "world", INK, 11)


def _axes(axes, origin, first, first_name, second, second_name, color):
    for end, name in ((first, first_name), (second, second_name)):
        arrow(axes, origin, end, color, 2)
        length = math.dist(origin, end)
        beyond = 1 + 0.14 / length
        place = [o + (e - o) * beyond for o, e in zip(origin, end)]
        write(axes, *place, name, color, 13)


if __name__ == "__main__":
    main()
