"""Text form of binary exports of a result folder, for comparison. Standard library only."""
import hashlib
import json
import struct
import zlib

NUMBERS = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 7: "f", 9: "d", 12: "q", 13: "Q"}  # type in a MAT-file: in Python
COMPRESSED, MATRIX = 15, 14
CELL, STRUCT, CHARACTERS = 1, 2, 4


def digest(data):
    return "sha256 " + hashlib.sha256(data).hexdigest()


def elements(data):
    """The (type, bytes) of every element of a MAT-file, level 5, from its bytes without the header."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from("<II", data, at)
        if kind >> 16:  # a small element: its size beside its type, and its data in the same eight bytes
            kind, size = kind & 0xFFFF, kind >> 16
            yield kind, data[at + 4:at + 4 + size]
            at += 8
        elif kind == COMPRESSED:
            yield from elements(zlib.decompress(data[at + 8:at + 8 + size]))
            at += 8 + size
        else:
            yield kind, data[at + 8:at + 8 + size]
            at += 8 + (size + 7) // 8 * 8


def matrix(data):
    """One variable of a MAT-file: a struct as a dictionary, a cell array as a list, characters as a string, numbers as
    their shape and the digest of their values as doubles, which the CSV file shows in full."""
    parts = list(elements(data))
    if not parts:
        return []
    kind = struct.unpack_from("<I", parts[0][1])[0] & 0xFF
    shape = list(struct.unpack(f"<{len(parts[1][1]) // 4}i", parts[1][1]))
    if kind == STRUCT:
        length = struct.unpack("<i", parts[3][1])[0]
        names = [parts[4][1][i:i + length].split(b"\0")[0].decode() for i in range(0, len(parts[4][1]), length)]
        return dict(zip(names, (matrix(content) for _, content in parts[5:])))
    if kind == CELL:
        return [matrix(content) for _, content in parts[3:]]
    if len(parts) < 4:
        return {"shape": shape}
    kind_of_data, content = parts[3]
    if kind == CHARACTERS:
        return content.decode("utf-8" if kind_of_data in (1, 2, 16) else "utf-16-le")
    format_ = NUMBERS[kind_of_data]
    values = struct.unpack(f"<{len(content) // struct.calcsize(format_)}{format_}", content)
    return {"shape": shape, "values": digest(struct.pack(f"<{len(values)}d", *values))}


def of_mat(data):
    """A MAT-file as JSON text. Raises ValueError, zlib.error or struct.error if it is invalid."""
    if data[:6] != b"MATLAB":
        raise ValueError("not a MAT-file")
    content = [matrix(part) for kind, part in elements(data[128:]) if kind == MATRIX]
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def of_glb(data):
    """A binary glTF file as JSON text: its own JSON, and of its buffer the digest of each view. Raises ValueError,
    KeyError or struct.error where it is none."""
    magic, _, _, size, kind = struct.unpack_from("<4sIII4s", data)
    if magic != b"glTF" or kind != b"JSON":
        raise ValueError("not a binary glTF file")
    scene = json.loads(data[20:20 + size])
    buffer = data[20 + size + 8:]
    views = []
    for view in scene.get("bufferViews", []):
        start = view.get("byteOffset", 0)
        views.append(digest(buffer[start:start + view["byteLength"]]))
    return json.dumps({"scene": scene, "buffer_views": views}, indent=1, ensure_ascii=False) + "\n"
