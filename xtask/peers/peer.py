"""What the render_*.py scripts share: their arguments, the clock, the picture, the line they end with.

The protocol: one process renders one picture, `render_NAME.py SCENE OUT.exr --size WxH --camera NAME --threads N
--effort N [--denoise] [--seed N]`. OUT.exr holds R, G, B as float32: linear Rec. 709, cd/m², box filter, first row
on top. The last line on stdout is JSON; exit 3 says that the renderer is not installed, exit 4 that it cannot do
what the scene asks.
"""

import argparse
import contextlib
import io
import json
import sys
import time

import gltf
import numpy as np
import OpenEXR
from PIL import Image


def arguments(description, effort):
    """The command line; `effort` explains --effort."""
    parser = argparse.ArgumentParser(description=description.split("\n")[0])
    parser.add_argument("scene", help=".gltf or .glb")
    parser.add_argument("out", help="the picture, .exr")
    parser.add_argument("--size", default="256x256", help="WIDTHxHEIGHT")
    parser.add_argument("--camera", help="name; the file's first by default")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--effort", type=int, required=True, help=effort)
    parser.add_argument(
        "--denoise", action="store_true", help="Open Image Denoise, guided by albedo and normal"
    )
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    args.width, args.height = map(int, args.size.split("x"))
    return args


def missing(line):
    """Ends the process: the renderer is not there; `line` says how to install it."""
    print(line, file=sys.stderr)
    sys.exit(3)


def beyond(line):
    """Ends the process: the renderer cannot do what `line` names."""
    print(line, file=sys.stderr)
    sys.exit(4)


def load(args):
    """The scene and the camera asked for. Ends the process where the scene has what no script here models."""
    try:
        scene = gltf.load(args.scene)
        camera = scene.camera(args.camera)
    except gltf.Unsupported as reason:
        beyond(str(reason))
    if camera.yfov is None:
        beyond("an orthographic camera")
    used = [scene.materials[i] for i in sorted({mesh.material for mesh in scene.meshes})]
    wanted = {
        "alpha": any(m.alpha_mode != "OPAQUE" for m in used),
        "unlit materials": any(m.unlit for m in used),
        "vertex colours": any(mesh.colors is not None for mesh in scene.meshes),
        "textures of roughness and metal": any(m.metallic_roughness_texture for m in used),
        "textures of the specular term": any(m.specular_texture or m.specular_color_texture for m in used),
        "textures of transmission": any(m.transmission_texture for m in used),
        "half metals": any(0 < m.metallic < 1 for m in used),
        "half transparent or rough glass": any(
            m.transmission > 0 and (m.transmission < 1 or m.roughness > 0 or m.metallic > 0) for m in used
        ),
        "index of refraction 0": any(m.ior < 1 for m in used),
    }
    if any(wanted.values()):
        beyond("not modelled for this renderer: " + ", ".join(name for name, yes in wanted.items() if yes))
    return scene, camera


def texture_uvs(mesh, texture):
    """Where `texture` is looked up at each vertex of `mesh`: (n, 2), v pointing up from the picture's lower edge."""
    uv = mesh.uvs[texture.uv_set]
    if uv is None:
        return np.zeros((len(mesh.positions), 2), np.float32)
    u, v = texture.transform[:, :2] @ uv.T.astype(np.float64) + texture.transform[:, 2:]
    return np.stack([u, 1 - v], -1).astype(np.float32)


def texels(scene, texture, linear):
    """A texture's texels (height × width × 3) in [0, 1], sRGB decoded if `linear`."""
    image = Image.open(io.BytesIO(scene.images[texture.image].data)).convert("RGB")
    values = np.asarray(image, np.float32) / 255
    return (
        np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4) if linear else values
    )


class Report:
    """What the runner hears about a picture."""

    def __init__(self):
        self.stages = {}
        self.notes = []

    @contextlib.contextmanager
    def stage(self, name):
        """Adds the wall-clock seconds spent within to the stage `name`."""
        start = time.perf_counter()
        yield
        self.stages[name] = self.stages.get(name, 0.0) + time.perf_counter() - start

    def note(self, sentence):
        """Says once in what the picture will not be glTF's."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def end(self, version, setting):
        """Prints the last line."""
        stages = {name: round(seconds, 3) for name, seconds in self.stages.items()}
        line = {"version": version, "setting": setting, "stages": stages, "notes": self.notes}
        print(json.dumps(line), flush=True)


def write_exr(path, pixels, comments, dtype=np.float32):
    """Writes `pixels` (height × width × 3, first row on top, cd/m²) as numbers of `dtype`."""
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "comments": comments,
    }
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels, dtype)}).write(str(path))


def read_exr(path):
    """R, G, B of a picture as float32."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.stack([np.asarray(file.channels()[c].pixels, np.float32) for c in "RGB"], -1)
