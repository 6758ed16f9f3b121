"""A quadricopter with the structure of V-REP's, as chunks of a V-REP file."""

from pathlib import Path

from vrep_encoder import mesh, numbers, scene_object, script, shape, weight

_PLACES = ((1, 1), (-1, 1), (-1, -1), (1, -1))
_SENSES = ("-0.002", "0.002", "-0.002", "0.002")
PROPELLER = (Path(__file__).parent / "scripts" / "particles_v3.lua").read_text()
PARAMETERS = {"particleCountPerSecond": "430", "particleDensity": "8500", "particleSize": "1", "particleVelocity": "0"}


def quadricopter(
    first=0, end="", at=(0, 0, 1), name="Quadricopter", code="x = 1", scale=1.0, propeller=PROPELLER, **changed
):
    """Return objects and scripts; handles start at `first`, names end in `end`, `code` is attached to the body."""
    body = weight(0.12 * scale**3, (6.667e-5 * scale**2, 7.533e-3 * scale**2, 7.533e-3 * scale**2))
    stick = mesh(size=(0.3 * scale, 0.02 * scale, 0.02 * scale))
    made = [shape(first, f"{name}{end}", stick, at=at, dynamic=True, wrapper=body, base=numbers("_fa", "Sfa", scale))]
    made.append(scene_object("DMY", first + 1, f"{name}_base{end}", first, (0, 0, -0.01 * scale)))
    target = shape(first + 2, f"{name}_target{end}", mesh("sphere", (0.1,) * 3), parent=first + 1, respondable=False)
    made += [target, script(first, code, parameters=[("gain", "2.5"), ("shown", "true")])] if code else [target]
    for number, (x, y) in enumerate(_PLACES, start=1):
        made += _propeller(
            first + 4 * number, number, name, end, scale, (x, y), first, propeller, {**PARAMETERS, **changed}
        )
    return made


def _propeller(handle, number, name, end, scale, place, root, code, parameters):
    arm = 0.09192 * scale
    disc = weight(0.1 * scale**3, (1.6326e-3 * scale**2, 1.6326e-3 * scale**2, 3.1693e-3 * scale**2))
    size = (0.15923 * scale, 0.15923 * scale, 0.024 * scale)
    code = code.replace("propeller1", f"propeller{number}").replace("respondable1", f"respondable{number}")
    code = code.replace("-0.002", _SENSES[number - 1])
    at = (arm * place[0], arm * place[1], 0.002 * scale)
    factor = numbers("_fa", "Sfa", scale)
    body = shape(
        handle + 1,
        f"{name}_propeller_respondable{number}{end}",
        mesh("cylinder", size),
        parent=handle,
        dynamic=True,
        wrapper=disc,
    )
    blades = shape(handle + 3, f"{name}_propeller_propeller{number}{end}", mesh(), parent=handle + 2, respondable=False)
    return [
        scene_object("FSE", handle, f"{name}_propeller{number}{end}", root, at, base=factor),
        body,
        scene_object("JNT", handle + 2, f"{name}_propeller_joint{number}{end}", handle + 1),
        blades,
        *([script(handle + 1, code, parameters=parameters.items())] if code else []),
    ]
