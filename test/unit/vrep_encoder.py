"""Encoder of small V-REP files for the tests: chunks, texts, scrambled scripts, Huffman codes of 8 bits."""

import struct

IDENTITY = (1.0, 0.0, 0.0, 0.0)  # w, x, y, z


def chunk(tag, data=b""):
    return tag.encode() + struct.pack("<i", len(data)) + data


def text(value):
    data = value if isinstance(value, bytes) else value.encode()
    return struct.pack("<i", len(data)) + data


def numbers(double, single, *values, version=22):
    """Return the single tag up to version 24, and the double tag from version 24 on."""
    doubles = chunk(double, struct.pack(f"<{len(values)}d", *values)) if version >= 24 else b""
    singles = chunk(single, struct.pack(f"<{len(values)}f", *values)) if version <= 24 else b""
    return singles + doubles


def integers(tag, *values):
    return chunk(tag, struct.pack(f"<{len(values)}i", *values))


def scrambled(plain):
    """Return the text of a script, scrambled as in V-REP files."""
    if len(plain) < 3:
        return plain
    signed = [byte - 256 if byte > 127 else byte for byte in (plain[0], plain[-1])]
    start, end = int(signed[0] / 2), 3 * signed[1]
    hidden = bytearray(plain)
    for i in range(1, len(plain) - 1):
        change = (i + start + end if i & 1 else 0) - (3 * i + start if i & 2 else 0) + (i // 2 + end if i & 4 else 0)
        hidden[i] = (plain[i] - change) & 255
    return bytes(hidden)


def huffman(payload):
    """Compress a payload with a tree in which each code is the byte itself."""

    def tree(depth, prefix):
        if depth == 8:
            return f"1{prefix:08b}"
        return f"0{tree(depth + 1, 2 * prefix)}{tree(depth + 1, 2 * prefix + 1)}"

    bits = tree(0, 0) + "".join(f"{byte:08b}" for byte in payload)
    bits += "0" * (-len(bits) % 8)
    return int(bits, 2).to_bytes(len(bits) // 8, "big")


def container(payload, version=22, compressed=False, length=None):
    header = struct.pack(
        "<4siiBiiH", b"VREP", version, 16, compressed, len(payload) if length is None else length, 0, 30601
    )
    return header.ljust(1021, b"\0") + (huffman(payload) if compressed else payload)


def packed(indices):
    """Return indices in the compressed form of an `In2` chunk."""
    data, before = struct.pack("<i", len(indices)), 0
    for index in indices:
        more = next(
            n for n, rest in enumerate((31, 8191, 2097151, 536870911)) if 0 <= index - before + rest < 1 << 6 + 8 * n
        )
        value = index - before + (31, 8191, 2097151, 536870911)[more]
        data += bytes([more << 6 | value & 63, *(value >> 6 + 8 * k & 255 for k in range(more))])
        before = index
    return data


# ---- objects

_PRIMITIVES = {"cuboid": 3, "sphere": 4, "cylinder": 5}
TRIANGLES = {"Ver": struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0), "In2": packed([0, 1, 2])}


def scene_object(tag, handle, name, parent=-1, at=(0, 0, 0), turned=IDENTITY, base=b"", own=b"", alias="", version=22):
    level = numbers("_fq", "Cfq", *turned, *at, version=version) + integers("Ids", handle, parent)
    level += chunk("Nme", text(name)) + (chunk("Ali", text(alias)) if alias else b"") + base
    return chunk(tag, level + b"NXT" + own + b"EOO")


def mesh(kind="cuboid", size=(1, 1, 1), at=(0, 0, 0), turned=IDENTITY, version=22, inline=True, more=b""):
    width = "d" if version >= 24 else "f"
    primitive = chunk("_pr" if version >= 24 else "Ppr", struct.pack(f"<i3{width}", _PRIMITIVES.get(kind, 0), *size))
    surface = b"".join(chunk(tag, data) for tag, data in TRIANGLES.items())
    surface = surface if inline else integers("Vev", 0) + integers("Inv", 0)
    return primitive + numbers("_pf", "Ppf", *at, *turned, version=version) + surface + more + b"EOO"


def weight(mass=1.0, moments=(1, 1, 1), at=(0, 0, 0), turned=IDENTITY, version=22):
    return numbers("_as", "Mas", mass, version=version) + numbers("_ne", "Ine", *at, *turned, *moments, version=version)


def shape(handle, name, *parts, parent=-1, at=(0, 0, 0), dynamic=False, respondable=True, wrapper=None, **more):
    """Return a shape with one mesh, or a compound of several."""
    wrapper = weight() if wrapper is None else wrapper
    if len(parts) > 1:
        geometry = chunk("Gsg", wrapper + b"".join(chunk("Geo", b"EOO" + part) for part in parts) + b"EOO")
    else:
        geometry = chunk("Gst", wrapper + b"EOO" + parts[0])
    own = chunk("Ge2", geometry + b"EOO") + chunk("Sss", bytes([0x80 * dynamic])) + chunk("Ss3", bytes([respondable]))
    return scene_object("SHP", handle, name, parent, at, own=own, **more)


def script(handle, code, kind=1, switches=8, parameters=(), tag="LST", more=b""):
    data = code if isinstance(code, bytes) else code.encode()
    listed = b"".join(text(name) + text("") + text(value) + struct.pack("<i", 0) for name, value in parameters)
    parameter_chunk = (
        chunk(
            "Prm",
            integers("Par", len(parameters))[:3]
            + struct.pack("<i", 4 + len(listed))
            + struct.pack("<i", len(parameters))
            + listed
            + b"EOO",
        )
        if parameters
        else b""
    )
    return chunk(
        tag,
        integers("Si2", 0, handle, kind)
        + chunk("Va2", bytes([switches]))
        + chunk("Ste", scrambled(data))
        + parameter_chunk
        + more
        + b"EOO",
    )


def collection_item(handle, kind, removes=False):
    """Return an item of a collection; `kind` 0: the object, 1 and 2: its tree, 3 and 4: its chain, 5: all objects."""
    switches = chunk("Gty", bytes([kind])) + chunk("Var", bytes([not removes]))
    return chunk("Asg", integers("Obj", handle, -1) + switches + b"EOO")


def file(*objects, version=22, compressed=False):
    return container(b"".join(objects) + b"EOF", version, compressed)
