"""The container of a glTF file: JSON, buffers, images and accessors as numpy arrays. See gltf.py."""

import base64
import json
import struct
from urllib.parse import unquote

import numpy as np

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
COMPONENTS = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
MODELLED = {
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}


class Unsupported(Exception):
    """The file needs something that is not read here."""


class File:
    """A .gltf or .glb file; `notes` says what in it is left out."""

    def __init__(self, path):
        self.folder = path.parent
        data = path.read_bytes()
        self.glb_buffer = None
        if data[:4] == b"glTF":
            size = struct.unpack_from("<I", data, 12)[0]
            self.json = json.loads(data[20 : 20 + size])
            if len(data) > 28 + size:
                length = struct.unpack_from("<I", data, 20 + size)[0]
                self.glb_buffer = data[28 + size : 28 + size + length]
        else:
            self.json = json.loads(data)
        missing = [e for e in self.json.get("extensionsRequired", []) if e not in MODELLED]
        if missing:
            raise Unsupported(f"the file requires {', '.join(missing)}")
        ignored = [e for e in self.json.get("extensionsUsed", []) if e not in MODELLED]
        self.notes = [f"{extension} is left out" for extension in ignored]
        self.buffers = [self._buffer(b) for b in self.json.get("buffers", [])]

    def _buffer(self, buffer):
        return self.uri(buffer["uri"]) if "uri" in buffer else self.glb_buffer

    def uri(self, uri):
        """The bytes behind a URI: a data URI, or a file beside this one."""
        if uri.startswith("data:"):
            head, body = uri.split(",", 1)
            return base64.b64decode(body) if head.endswith(";base64") else unquote(body).encode("latin-1")
        plain = self.folder / uri
        return (plain if plain.exists() else self.folder / unquote(uri)).read_bytes()

    def view(self, index, offset=0):
        """Bytes of a buffer view from `offset` on, and its stride or None."""
        view = self.json["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.buffers[view["buffer"]][start + offset : start + view["byteLength"]], view.get(
            "byteStride"
        )

    def _rows(self, view, offset, count, width, dtype):
        data, stride = self.view(view, offset)
        size = width * dtype.itemsize
        stride = stride or size
        if count == 0:
            return np.empty((0, width), dtype)
        flat = np.frombuffer(data, np.uint8, (count - 1) * stride + size)
        rows = np.lib.stride_tricks.as_strided(flat, (count, size), (stride, 1))
        return np.ascontiguousarray(rows).view(dtype)

    def accessor(self, index):
        """An accessor's rows: floats where it is normalised, else its own type."""
        a = self.json["accessors"][index]
        width, dtype = WIDTHS[a["type"]], np.dtype(COMPONENTS[a["componentType"]])
        if "bufferView" in a:
            rows = self._rows(a["bufferView"], a.get("byteOffset", 0), a["count"], width, dtype)
        else:
            rows = np.zeros((a["count"], width), dtype)
        if "sparse" in a:
            s, rows = a["sparse"], rows.copy()
            where = s["indices"]
            kind = np.dtype(COMPONENTS[where["componentType"]])
            at = self._rows(where["bufferView"], where.get("byteOffset", 0), s["count"], 1, kind)
            values = s["values"]
            rows[at[:, 0]] = self._rows(
                values["bufferView"], values.get("byteOffset", 0), s["count"], width, dtype
            )
        if a.get("normalized") and dtype.kind in "iu":
            rows = np.maximum(rows.astype(np.float32) / np.iinfo(dtype).max, -1)
        return rows

    def note(self, text):
        """Says `text` once."""
        if text not in self.notes:
            self.notes.append(text)
