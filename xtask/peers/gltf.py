"""Just enough of glTF 2.0 to read the scenes in assets/: one mesh a node, no hierarchy, no sparse accessors."""

import base64
import json
import struct
from pathlib import Path

import numpy as np

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TYPES = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}


class Gltf:
    """A parsed .gltf with an embedded buffer, or a .glb."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        if data[:4] == b"glTF":
            size = struct.unpack_from("<I", data, 12)[0]
            self.json = json.loads(data[20 : 20 + size])
            self.buffer = data[28 + size :]
        else:
            self.json = json.loads(data)
            uri = self.json["buffers"][0]["uri"]
            self.buffer = base64.b64decode(uri.split(",", 1)[1])

    def view(self, index):
        """The bytes of a buffer view."""
        view = self.json["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.buffer[start : start + view["byteLength"]]

    def accessor(self, index):
        """An accessor's rows, as the file has them: nothing is converted."""
        accessor = self.json["accessors"][index]
        flat = np.frombuffer(self.view(accessor["bufferView"]), TYPES[accessor["componentType"]])
        width = COMPONENTS[accessor["type"]]
        return flat[: accessor["count"] * width].reshape(accessor["count"], width)

    def image(self, texture):
        """The PNG bytes behind a texture."""
        return self.view(self.json["images"][self.json["textures"][texture]["source"]]["bufferView"])

    def nodes(self, kind):
        """Nodes that hold a mesh, a camera, or (as an extension) a light."""
        for node in self.json["nodes"]:
            if kind in node or kind in node.get("extensions", {}):
                yield node

    @staticmethod
    def frame(node):
        """Position, and the columns of the rotation."""
        x, y, z, w = node.get("rotation", [0, 0, 0, 1])
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        return np.array(node.get("translation", [0.0, 0.0, 0.0])), rotation
