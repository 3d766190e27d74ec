"""Renders a scene with LuxCore: python xtask/peers/render_luxcore.py SCENE OUT.exr --effort SPP ...

The same as in glTF: triangles, shading normals, textures, lamps that shine from their front, Lambertian surfaces,
clear and coloured solid glass. What differs is in the notes of each picture.

Settings: path tracing with Sobol samples, the same number for each pixel (--effort), each counted in the pixel it
falls in, paths of up to 1000 bounces, nothing clamped, lamps chosen by their power. Russian roulette begins at bounce
8: it upsets LuxCore's weights of light found by chance and by choice, which brightens a furnace by 2 % with the
default of 3 and by 0.04 % with 8, while the error in equal time falls a little. Measured in the Cornell box with a
glass ball: light traced from the lamps too (hybridbackforward) takes 2.1 times as long for 0.9 times the error, and
bidirectional paths give 5 % too much light.
"""

import contextlib
import math
import os
import sys
import tempfile
import time
from pathlib import Path

import peer

try:
    with contextlib.redirect_stdout(None):  # it lists its libraries
        import pyluxcore
except ImportError:
    peer.missing("LuxCore is not installed: cargo xtask peers install")
import numpy as np

report = peer.Report()


def properties(tree, prefix=""):
    """LuxCore's properties from nested dictionaries: {"film": {"width": 256}} is film.width = 256."""
    result = pyluxcore.Properties()
    for key, value in tree.items():
        if isinstance(value, dict):
            result.Set(properties(value, f"{prefix}{key}."))
        else:
            values = np.atleast_1d(value)
            if prefix.startswith("scene.") and values.dtype.kind == "i":
                values = values.astype(float)  # glTF may write 1 for 1.0; LuxCore tells them apart
            result.Set(pyluxcore.Property(prefix + key, values.tolist()))
    return result


class World:
    """The scene as LuxCore's properties, gathered by kind and name."""

    def __init__(self, scene, folder):
        self.scene, self.folder = scene, folder
        self.textures, self.materials, self.volumes, self.lights, self.objects = {}, {}, {}, {}, {}

    def image(self, name, texture, factor, gamma=2.2):
        """Defines the texture `name`, an image times `factor`; returns the name."""
        image = self.scene.images[texture.image]
        path = self.folder / f"{texture.image}{image.suffix}"
        path.write_bytes(image.data)
        if texture.wrap_s == "mirror":
            report.note("Textures that should be mirrored repeat.")
        if gamma > 1:
            report.note("Textures are decoded with a power of 2.2, not with sRGB's curve.")
        wrap = "clamp" if texture.wrap_s == "clamp" else "repeat"
        self.textures[f"{name}-image"] = {"type": "imagemap", "file": str(path), "gamma": gamma, "wrap": wrap}
        self.textures[name] = {"type": "scale", "texture1": f"{name}-image", "texture2": factor}
        return name

    def material(self, i):
        """Defines material `i`."""
        m, name = self.scene.materials[i], f"m{i}"
        base = m.base_color
        if m.base_color_texture:
            base = self.image(f"{name}-base", m.base_color_texture, base)
        values = self.reflection(m, name, base)
        if m.normal_texture:
            texels = self.image(f"{name}-normal", m.normal_texture, (1.0, 1.0, 1.0), gamma=1.0)
            self.textures[f"{name}-bump"] = {"type": "normalmap", "texture": texels, "scale": m.normal_scale}
            values["bumptex"] = f"{name}-bump"
        if m.is_emissive:
            light = m.emissive
            if m.emissive_texture:
                light = self.image(f"{name}-light", m.emissive_texture, light)
            values["emission"] = light
            # Else lamps of more than 24 triangles are found by chance only.
            values["emission.directlightsampling.type"] = "ENABLED"
            if m.double_sided:
                report.note("Lamps shine from their front only.")
        self.materials[name] = values

    def reflection(self, m, name, base):
        """LuxCore's nearest to what material `m` does with light."""
        alpha = m.roughness**2  # LuxCore squares it again, which makes Schlick's distribution GGX's
        rough = {"uroughness": alpha, "vroughness": alpha}
        if m.is_solid:
            volume = {"type": "clear", "ior": m.ior, "absorption": (0.0, 0.0, 0.0)}
            if math.isfinite(m.attenuation_distance):
                volume["absorption"] = -np.log(np.maximum(m.attenuation_color, 1e-6)) / m.attenuation_distance
            self.volumes[f"{name}-inside"] = volume  # volumes and materials share their names
            return {"type": "glass", "kr": (1.0, 1.0, 1.0), "kt": base, "volume.interior": f"{name}-inside"}
        if m.transmission > 0:
            report.note("Thin glass is `archglass`, a pane with two surfaces and Fresnel's equations.")
            return {"type": "archglass", "kr": (1.0, 1.0, 1.0), "kt": base, "interiorior": m.ior}
        if m.is_lambert:
            return {"type": "matte", "kd": base}
        if m.metallic and m.roughness == 0:
            report.note("Mirrors lack Schlick's rise toward grazing angles.")
            return {"type": "mirror", "kr": base}
        if m.metallic:
            report.note("Rough metal is `metal2`: GGX with another masking term, and Fresnel's equations.")
            self.textures[f"{name}-fresnel"] = {"type": "fresnelcolor", "kr": base}
            return {"type": "metal2", "fresnel": f"{name}-fresnel"} | rough
        report.note("Glossy dielectrics are `glossy2`: GGX with another masking term, glossy on their front only.")
        gloss = m.specular * np.array(m.specular_color)
        return {"type": "glossy2", "kd": base, "ks": gloss, "index": m.ior} | rough

    def lamp(self, light):
        """A KHR_lights_punctual lamp."""
        gain = 1.0
        if light.kind == "directional":
            values = {"type": "sharpdistant", "direction": light.direction}
        else:
            values = {"type": light.kind, "position": light.position}
            if math.isfinite(light.range):
                report.note("Lamps reach beyond their range.")
        if light.kind == "spot":
            # LuxCore's rim follows the fourth power of the cosine's way across it, glTF's the second. Made 5/3 times
            # as wide, it carries the same flux and stays within 4 % of the axis's intensity.
            inner, outer = math.cos(light.inner), math.cos(light.outer)
            widened = math.acos(max(inner - 5 / 3 * (inner - outer), -1))
            values = {"type": "spot", "position": light.position, "target": light.position + light.direction}
            values |= {"coneangle": math.degrees(widened), "conedeltaangle": math.degrees(widened - light.inner)}
            # Measured: LuxCore divides by the cosine from the axis. Its mean over the flux is taken back.
            cap, rim = 1 - inner, (inner - outer) / 3
            gain = (cap * (1 + inner) / 2 + rim * (inner - (inner - outer) / 4)) / (cap + rim)
            report.note("A spot's rim is that of LuxCore, widened to the same flux, and its cone brightens outward.")
        self.lights[f"l{len(self.lights)}"] = values | {"gain": gain * light.intensity}

    def shape(self, world, i, mesh):
        """Defines mesh `i` in LuxCore's scene `world`."""
        m = self.scene.materials[mesh.material]
        textures = [t for t in (m.base_color_texture, m.emissive_texture, m.normal_texture) if t]
        rows = [peer.texture_uvs(mesh, t) * (1, -1) + (0, 1) for t in textures]  # v points down
        if any((uv != rows[0]).any() for uv in rows):
            peer.beyond("textures of one material that lie differently")
        # Lamps are sampled as if their shading normals were those of the triangles.
        normals = None if m.is_emissive and not m.normal_texture else tuples(mesh.normals)
        uvs = tuples(rows[0]) if rows else None
        world.DefineMesh(f"s{i}", tuples(mesh.positions), tuples(mesh.triangles), normals, uvs, None, None)
        self.objects[f"o{i}"] = {"shape": f"s{i}", "material": f"m{mesh.material}"}


def tuples(rows):
    """An array as the list of tuples that LuxCore takes."""
    return list(map(tuple, rows.tolist()))


def view(camera, args):
    """LuxCore's camera."""
    # LuxCore's film has its picture one row too low; the window makes up for it.
    aspect, row = args.width / args.height, 2 / args.height
    return {
        "type": "perspective",
        "lookat": {"orig": camera.position, "target": camera.position - camera.back},
        "up": camera.up,
        "fieldofview": math.degrees(camera.yfov),
        "screenwindow": (-aspect, aspect, -1 - row, 1 - row),
        "cliphither": max(camera.near, 1e-4),
        "clipyon": 1e6,
    }


def build(scene, camera, args, folder):
    """LuxCore's scene."""
    world, gathered = pyluxcore.Scene(), World(scene, folder)
    for i in sorted({mesh.material for mesh in scene.meshes}):
        gathered.material(i)
    for i, mesh in enumerate(scene.meshes):
        gathered.shape(world, i, mesh)
    for light in scene.lights:
        gathered.lamp(light)
    kinds = ("textures", "volumes", "materials", "objects", "lights")
    tree = {"camera": view(camera, args)} | {kind: getattr(gathered, kind) for kind in kinds}
    world.Parse(properties({"scene": tree}))
    return world


def settings(args):
    """LuxCore's settings of the picture."""
    depth = {"total": 1000, "diffuse": 1000, "glossy": 1000, "specular": 1000}
    return {
        "renderengine": {"type": "PATHCPU", "seed": args.seed + 1},
        "native.threads.count": args.threads,
        "sampler": {"type": "SOBOL", "sobol.adaptive.strength": 0.0},
        "lightstrategy.type": "POWER",
        "path": {"pathdepth": depth, "clamping.variance.maxvalue": 0.0, "russianroulette.depth": 8},
        "film": {"width": args.width, "height": args.height, "filter.type": "NONE"},
        "film.outputs.0": {"type": "RGB", "filename": "unused.exr"},
        "batch.haltspp": [args.effort, 0],
    }


def main():
    args = peer.arguments(__doc__, "samples a pixel")
    if args.denoise:
        peer.beyond("denoising is not set up for LuxCore")
    pyluxcore.Init(lambda line: None)
    with report.stage("load"), tempfile.TemporaryDirectory() as folder:
        scene, camera = peer.load(args)
        report.notes += scene.notes
        world = build(scene, camera, args, Path(folder))
        tree = settings(args)
        session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties(tree), world))
    pixels = np.zeros((args.height, args.width, 3), np.float32)
    with report.stage("render"):
        session.Start()
        while not session.HasDone():
            time.sleep(0.01)
            session.UpdateStats()  # which is what notices the end
        session.Stop()
        session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels, 0, False)
    peer.write_exr(args.out, pixels[::-1], f"{Path(args.scene).name}, LuxCore, {args.effort} spp, cd/m2")
    report.end(f"LuxCore {pyluxcore.Version()}", f"{args.effort} spp")
    # LuxCore crashes when Python takes it down; all is written by now.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
