"""Renders a scene of assets/ with Mitsuba 3: two independent halves, box filter, linear Rec. 709 in cd/m².

    python xtask/peers/render_mitsuba.py SCENE OUT --size 256x256 --spp 4096 [--camera NAME]

writes OUT.a.exr and OUT.b.exr, --spp samples a pixel each, and prints the noise of their mean. Uses the variant
llvm_ad_rgb where an LLVM library is found (Debian's libllvm19, or DRJIT_LIBLLVM_PATH), else scalar_rgb.

What is the same: triangles and normals (float32, as in the file), Lambertian surfaces, area lamps that shine from
their front, textures, perfect mirrors (with glTF's Schlick term), solid clear glass (Fresnel's equations).

What differs, and is printed when a scene has it: thin glass (Mitsuba sums all reflections within the pane, glTF
has one surface), coloured glass (taken as clear), rough metal without Schlick's term, rough dielectrics
(Mitsuba's `principled` is not glTF's), the rim of a spot's cone.
"""

import argparse
import math
import tempfile
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import OpenEXR
from gltf import Gltf

try:
    mi.set_variant("llvm_ad_rgb")
    dr.eval(mi.Float(0) + 1)
except Exception:
    mi.set_variant("scalar_rgb")


class SchlickMirror(mi.BSDF):
    """A perfect mirror of reflectance F0 + (1 − F0)(1 − cos θ)⁵: glTF's metal at roughness 0."""

    def __init__(self, props):
        super().__init__(props)
        self.f0 = mi.Color3f(props["f0"])
        self.m_components = [mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def sample(self, ctx, si, sample1, sample2, active):
        cos = mi.Frame3f.cos_theta(si.wi)
        active &= cos > 0
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.reflect(si.wi)
        bs.pdf = 1.0
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DeltaReflection)
        return bs, dr.select(active, self.f0 + (1 - self.f0) * (1 - cos) ** 5, 0)

    def eval(self, ctx, si, wo, active):
        return mi.Color3f(0)

    def pdf(self, ctx, si, wo, active):
        return mi.Float(0)

    def eval_pdf(self, ctx, si, wo, active):
        return mi.Color3f(0), mi.Float(0)

    def to_string(self):
        return f"SchlickMirror[{self.f0}]"


mi.register_bsdf("schlick_mirror", SchlickMirror)
said = set()


def differs(what):
    """Says once in what the picture will not be glTF's."""
    if what not in said:
        said.add(what)
        print(f"differs from glTF: {what}")


def rgb(value):
    return {"type": "rgb", "value": list(value)}


def bitmap(gltf, texture, scale=None, raw=False):
    """A texture; `scale` (per channel) is multiplied in after decoding."""
    stream = mi.MemoryStream()
    stream.write(gltf.image(texture))
    stream.seek(0)
    image = mi.Bitmap(stream)
    if not raw:
        image = image.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    if scale is not None:
        image = mi.Bitmap(np.array(image) * np.array(scale, np.float32))
    return {"type": "bitmap", "bitmap": image, "raw": True, "wrap_mode": "repeat"}


def bsdf(gltf, material):
    """The BSDF of a glTF material; what reflects does so from both sides."""
    pbr = material["pbrMetallicRoughness"]
    extensions = material.get("extensions", {})
    base = pbr["baseColorFactor"][:3]
    roughness = pbr["roughnessFactor"]
    color = rgb(base)
    if "baseColorTexture" in pbr:
        color = bitmap(gltf, pbr["baseColorTexture"]["index"], scale=base)
    if "KHR_materials_transmission" in extensions:
        volume = extensions.get("KHR_materials_volume")
        if volume is None:
            differs("thin glass, all inner reflections summed")
            return {"type": "thindielectric", "int_ior": 1.5}
        if "attenuationDistance" in volume:
            differs("coloured glass, taken as clear")
        return {"type": "dielectric", "int_ior": 1.5}
    if pbr["metallicFactor"] == 1 and roughness == 0:
        inner = {"type": "schlick_mirror", "f0": mi.ScalarColor3f(base)}
    elif pbr["metallicFactor"] == 1:
        differs("rough metal, without Schlick's term")
        inner = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": roughness**2}
        inner["specular_reflectance"] = color
    elif extensions.get("KHR_materials_specular", {}).get("specularFactor", 1) == 0:
        inner = {"type": "diffuse", "reflectance": color}
    else:
        differs("rough dielectric, as Mitsuba's `principled`")
        inner = {"type": "principled", "base_color": color, "roughness": roughness, "specular": 0.5}
    if "normalTexture" in material:
        differs("normal map, as Mitsuba's `normalmap`")
        normals = bitmap(gltf, material["normalTexture"]["index"], raw=True)
        inner = {"type": "normalmap", "bsdf": inner, "normalmap": normals}
    return {"type": "twosided", "bsdf": inner}


def shape(gltf, node, folder):
    """A node's mesh as a PLY file, which holds float32 exactly."""
    (primitive,) = gltf.json["meshes"][node["mesh"]]["primitives"]
    material = gltf.json["materials"][primitive["material"]]
    attributes = {name: gltf.accessor(index) for name, index in primitive["attributes"].items()}
    columns = [attributes["POSITION"], attributes["NORMAL"]]
    names = ["x", "y", "z", "nx", "ny", "nz"]
    if "TEXCOORD_0" in attributes:
        columns.append(attributes["TEXCOORD_0"])
        names += ["u", "v"]
    vertices = np.hstack(columns).astype("<f4")
    triangles = gltf.accessor(primitive["indices"]).reshape(-1, 3)
    faces = np.empty(len(triangles), [("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, triangles
    header = [f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}\nproperty list uchar int vertex_index\nend_header\n"]
    path = folder / f"{node['mesh']}.ply"
    path.write_bytes("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())

    result = {"type": "ply", "filename": str(path), "bsdf": bsdf(gltf, material)}
    if "emissiveFactor" in material:
        strength = material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
        radiance = strength * np.array(material["emissiveFactor"])
        light = rgb(radiance)
        if "emissiveTexture" in material:
            light = bitmap(gltf, material["emissiveTexture"]["index"], scale=radiance)
        # A lamp's front is its triangle's, whatever the normals.
        result |= {"emitter": {"type": "area", "radiance": light}, "face_normals": True}
    return result


def spot(gltf, node):
    """A KHR_lights_punctual spot."""
    light = gltf.json["extensions"]["KHR_lights_punctual"]["lights"][
        node["extensions"]["KHR_lights_punctual"]["light"]
    ]
    differs("the rim of the spot's cone")
    origin, rotation = gltf.frame(node)
    target = origin - rotation[:, 2]
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(list(origin), list(target), list(rotation[:, 1])),
        "intensity": rgb(light["intensity"] * np.array(light["color"])),
        "beam_width": math.degrees(light["spot"]["innerConeAngle"]),
        "cutoff_angle": math.degrees(light["spot"]["outerConeAngle"]),
    }


def sensor(gltf, name, width, height):
    """The camera called `name`, or the file's first."""
    nodes = [node for node in gltf.nodes("camera") if name in (None, node["name"])]
    origin, rotation = gltf.frame(nodes[0])
    perspective = gltf.json["cameras"][nodes[0]["camera"]]["perspective"]
    target = origin - rotation[:, 2]
    return {
        "type": "perspective",
        "fov": math.degrees(perspective["yfov"]),
        "fov_axis": "y",
        "near_clip": 0.001,
        "far_clip": 1000.0,
        "to_world": mi.ScalarTransform4f().look_at(list(origin), list(target), list(rotation[:, 1])),
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
        "sampler": {"type": "multijitter"},
    }


def load(path, camera, width, height):
    """The scene as Mitsuba has it."""
    gltf = Gltf(path)
    scene = {"type": "scene", "integrator": {"type": "path", "max_depth": -1, "rr_depth": 12}}
    scene["camera"] = sensor(gltf, camera, width, height)
    with tempfile.TemporaryDirectory() as folder:
        for i, node in enumerate(gltf.nodes("mesh")):
            scene[f"shape{i}"] = shape(gltf, node, Path(folder))
        for i, node in enumerate(gltf.nodes("KHR_lights_punctual")):
            scene[f"light{i}"] = spot(gltf, node)
        return mi.load_dict(scene)


def halves(scene, spp, budget):
    """Two independent means of `spp` samples a pixel, made in passes small enough for memory; fewer passes when
    `budget` seconds of processor time are over. Returns both pictures and the samples each has."""
    # A square number, so that the sampler can stratify a pass over the pixel.
    per_pass = min(math.ceil(math.sqrt(spp)), 12) ** 2
    totals, passes, start = [0.0, 0.0], 0, time.process_time()
    while passes * per_pass < spp and (passes == 0 or time.process_time() - start < budget):
        for i in (0, 1):
            picture = mi.render(scene, spp=per_pass, seed=2 * passes + i)
            totals[i] = totals[i] + np.array(picture, np.float64)
        passes += 1
    return totals[0] / passes, totals[1] / passes, passes * per_pass


def noise(a, b):
    """Error of the mean of two independent halves, %, by the metric of `twolight compare`: half their difference,
    relative to mean_c ref² + 0.01 M², M the mean luminance with the brightest tenth of pixels capped."""
    mean = 0.5 * (a + b)
    luminance = mean @ [0.2126, 0.7152, 0.0722]
    level = np.minimum(luminance, np.quantile(luminance, 0.9)).mean()
    error = (0.25 * (a - b) ** 2).mean(-1) / ((mean**2).mean(-1) + 0.01 * level**2)
    return 100 * math.sqrt(error.mean())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--size", default="256x256", help="WIDTHxHEIGHT")
    parser.add_argument("--spp", type=int, default=1024, help="samples a pixel of each half")
    parser.add_argument("--camera", help="name; the file's first by default")
    parser.add_argument("--seconds", type=float, default=math.inf, help="stop after this much processor time")
    args = parser.parse_args()
    width, height = map(int, args.size.split("x"))
    scene = load(args.scene, args.camera, width, height)
    a, b, spp = halves(scene, args.spp, args.seconds)
    for name, picture in (("a", a), ("b", b)):
        header = {
            "compression": OpenEXR.ZIP_COMPRESSION,
            "type": OpenEXR.scanlineimage,
            "comments": f"{Path(args.scene).name}, Mitsuba {mi.__version__}, path, {spp} spp, cd/m2",
        }
        pixels = np.ascontiguousarray(picture, np.float16)
        OpenEXR.File(header, {"RGB": pixels}).write(f"{args.out}.{name}.exr")
    print(f"Mitsuba {mi.__version__} {mi.variant()}: 2 x {spp} spp, noise of the mean {noise(a, b):.3f} %")


if __name__ == "__main__":
    main()
