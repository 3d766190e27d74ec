"""Renders a scene with Blender's Cycles: python xtask/peers/render_cycles.py SCENE OUT.exr --effort SPP ...

The same as in glTF: triangles, shading normals, textures, lamps that shine from their front, Lambertian surfaces,
metal (GGX with Schlick's term), clear and coloured solid glass, thin glass as one surface with Schlick's term, a
spot's cone and its rim. What differs is in the notes of each picture.

Settings: light tree, all caustics, nothing clamped or blurred, up to 1024 bounces, the same number of samples for
each pixel, which is --effort. Measured in the Cornell boxes: path guiding has 1.4 times the error in the same time,
adaptive sampling the same error and, with a glass ball, loses 1 % of the light.
"""

import math
import tempfile
from pathlib import Path

import peer

try:
    import bpy
except ImportError:
    peer.missing("Cycles is not installed: cargo xtask peers install")
import numpy as np
from mathutils import Matrix

report = peer.Report()


class Nodes:
    """A tree of shader nodes, written as calls: `nodes(kind, {input: socket or value})` gives a socket."""

    def __init__(self, tree):
        tree.nodes.clear()
        self.tree = tree

    def __call__(self, kind, inputs=None, output=0, **settings):
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node.outputs[output] if len(node.outputs) else None

    def math(self, operation, *values, clamp=False):
        """Arithmetic on numbers."""
        return self("Math", dict(enumerate(values)), operation=operation, use_clamp=clamp)

    def dot(self, a, b):
        """|a · b|."""
        product = self("VectorMath", {0: a, 1: b}, output="Value", operation="DOT_PRODUCT")
        return self.math("ABSOLUTE", product)

    def color(self, factor, texture, images, slot):
        """A colour, times that of a texture if there is one."""
        if texture is None:
            return (*factor, 1.0)
        color = self.image(texture, images, slot)
        inputs = {0: 1.0, 6: color, 7: (*factor, 1.0)}
        return self("Mix", inputs, output=2, data_type="RGBA", blend_type="MULTIPLY")

    def image(self, texture, images, slot, linear=False):
        """The texel at the uv layer `slot`."""
        image = images[texture.image, linear]
        extension = {"repeat": "REPEAT", "mirror": "MIRROR", "clamp": "EXTEND"}[texture.wrap_s]
        uv = self("UVMap", uv_map=slot)
        return self(
            "TexImage",
            {"Vector": uv},
            image=image,
            extension=extension,
            interpolation="Linear" if texture.linear else "Closest",
        )


class Images(dict):
    """Blender's images by (number in the scene, whether the file holds linear values), loaded when first asked for."""

    def __init__(self, scene, folder):
        self.scene, self.folder = scene, folder

    def __missing__(self, key):
        number, linear = key
        path = self.folder / f"{number}{self.scene.images[number].suffix}"
        path.write_bytes(self.scene.images[number].data)
        image = bpy.data.images.load(str(path))
        image.colorspace_settings.name = "Non-Color" if linear else "sRGB"
        image.pack()
        self[key] = image
        return image


def material(m, images):
    """A material of the scene as a tree of nodes."""
    result = bpy.data.materials.new(m.name)
    result.use_nodes = True
    nodes = Nodes(result.node_tree)
    base = nodes.color(m.base_color, m.base_color_texture, images, "base")
    shading = {}
    if m.normal_texture:
        texel = nodes.image(m.normal_texture, images, "normal", linear=True)
        shading["Normal"] = nodes("NormalMap", {"Color": texel, "Strength": m.normal_scale}, uv_map="normal")
    outputs = {}
    if m.is_solid:
        inputs = {"Color": base, "Roughness": 0.0, "IOR": m.ior} | shading
        shader = nodes("BsdfGlass", inputs)
        if math.isfinite(m.attenuation_distance):
            sigma = -np.log(np.maximum(m.attenuation_color, 1e-6)) / m.attenuation_distance
            color = (*(1 - sigma / sigma.max()), 1.0)
            outputs["Volume"] = nodes("VolumeAbsorption", {"Color": color, "Density": float(sigma.max())})
    elif m.transmission > 0:
        shader = thin_glass(nodes, m, base)
    elif m.is_lambert:
        shader = nodes("BsdfDiffuse", {"Color": base} | shading)
    else:
        inputs = {"Base Color": base, "Metallic": m.metallic, "Roughness": m.roughness, "IOR": m.ior}
        inputs |= {"Specular IOR Level": 0.5 * m.specular, "Specular Tint": (*m.specular_color, 1.0)}
        if m.metallic:
            inputs["Specular Tint"] = (1, 1, 1, 1)  # the tint at 82°; white leaves Schlick's term
        else:
            report.note(
                "Glossy dielectrics are Blender's Principled: Fresnel's equations in place of Schlick's, and a diffuse"
                " base weighed by the albedo of the gloss."
            )
        shader = nodes("BsdfPrincipled", inputs | shading, distribution="GGX")
    if m.is_emissive:
        shader = nodes("AddShader", {0: shader, 1: emission(nodes, m, images)})
        result.cycles.emission_sampling = "FRONT_BACK" if m.double_sided else "FRONT"
    nodes("OutputMaterial", outputs | {"Surface": shader})
    return result


def thin_glass(nodes, m, base):
    """One surface: Schlick's share reflected, the rest straight on, tinted."""
    normal, incoming = (nodes("NewGeometry", output=name) for name in ("Normal", "Incoming"))
    off = nodes.math("SUBTRACT", 1.0, nodes.dot(normal, incoming), clamp=True)
    f0 = ((m.ior - 1) / (m.ior + 1)) ** 2
    share = nodes.math("MULTIPLY_ADD", nodes.math("POWER", off, 5.0), 1 - f0, f0)
    share = nodes.math("MULTIPLY", share, m.specular)
    mirror = nodes("BsdfAnisotropic", {"Color": (1, 1, 1, 1), "Roughness": 0.0})
    return nodes("MixShader", {0: share, 1: nodes("BsdfTransparent", {"Color": base}), 2: mirror})


def emission(nodes, m, images):
    """Light from the front, from both sides where the material says so."""
    strength = max(m.emissive)
    color = nodes.color([e / strength for e in m.emissive], m.emissive_texture, images, "emissive")
    if not m.double_sided:
        front = nodes.math("SUBTRACT", 1.0, nodes("NewGeometry", output="Backfacing"))
        strength = nodes.math("MULTIPLY", front, strength)
    return nodes("Emission", {"Color": color, "Strength": strength})


def shape(mesh, m, shader):
    """A mesh as an object in the scene."""
    data = bpy.data.meshes.new(mesh.name)
    triangles = mesh.triangles.astype(np.int32)
    data.vertices.add(len(mesh.positions))
    data.vertices.foreach_set("co", mesh.positions.ravel())
    data.loops.add(triangles.size)
    data.loops.foreach_set("vertex_index", triangles.ravel())
    data.polygons.add(len(triangles))
    data.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    slots = {"base": m.base_color_texture, "emissive": m.emissive_texture, "normal": m.normal_texture}
    for slot, texture in slots.items():
        if texture:
            uv = peer.texture_uvs(mesh, texture)[triangles.ravel()]
            data.uv_layers.new(name=slot).data.foreach_set("uv", uv.ravel())
    data.update(calc_edges=True)
    if data.validate():
        report.note("Degenerate triangles are left out.")
    data.normals_split_custom_set_from_vertices(mesh.normals)
    data.materials.append(shader)
    bpy.context.collection.objects.link(bpy.data.objects.new(mesh.name, data))


def lamp(light):
    """A KHR_lights_punctual lamp."""
    kind = {"point": "POINT", "spot": "SPOT", "directional": "SUN"}[light.kind]
    data = bpy.data.lights.new(light.name, kind)
    strength = float(light.intensity.max())
    data.color = light.intensity / (strength or 1)
    data.cycles.max_bounces = 1024
    if kind == "SUN":
        data.energy, data.angle = strength, 0
    else:
        # Blender gives lamps in watts: those of a lamp that shines alike all around.
        data.energy, data.shadow_soft_size = 4 * math.pi * strength, 0
        if math.isfinite(light.range):
            report.note("Lamps reach beyond their range.")
    if kind == "SPOT":
        data.spot_size, data.spot_blend = 2 * light.outer, 0
        data.use_nodes = True
        nodes = Nodes(data.node_tree)
        rim = math.cos(light.outer)
        width = max(math.cos(light.inner) - rim, 1e-3)
        cos = nodes.dot(nodes("NewGeometry", output="Incoming"), tuple(light.direction))
        share = nodes.math("DIVIDE", nodes.math("SUBTRACT", cos, rim), width, clamp=True)
        nodes("OutputLight", {0: nodes("Emission", {"Strength": nodes.math("MULTIPLY", share, share)})})
    up = np.cross(light.direction, [0.3, 0.5, 0.8])
    up /= np.linalg.norm(up)
    place(bpy.data.objects.new(light.name, data), np.cross(light.direction, up), up, -light.direction, light.position)


def place(thing, right, up, back, position):
    """Puts a camera or lamp, which look along −back, into the scene."""
    frame = np.eye(4)
    frame[:3, :] = np.stack([right, up, back, position], -1)
    thing.matrix_world = Matrix(frame.tolist())
    bpy.context.collection.objects.link(thing)
    return thing


def build(scene, camera, folder):
    """Fills Blender's empty scene."""
    images = Images(scene, folder)
    shaders = {}
    for mesh in scene.meshes:
        m = scene.materials[mesh.material]
        if mesh.material not in shaders:
            shaders[mesh.material] = material(m, images)
        shape(mesh, m, shaders[mesh.material])
    for light in scene.lights:
        lamp(light)
    data = bpy.data.cameras.new(camera.name)
    data.sensor_fit, data.angle_y = "VERTICAL", camera.yfov
    data.clip_start, data.clip_end = max(camera.near, 1e-4), 1e6
    bpy.context.scene.camera = place(
        bpy.data.objects.new(camera.name, data), camera.right, camera.up, camera.back, camera.position
    )


def settle(args, out):
    """Settings of the picture."""
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = args.width, args.height, 100
    render.threads_mode, render.threads = "FIXED", args.threads
    render.use_compositing = render.use_sequencer = False
    render.filepath = str(out)
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles.device, cycles.samples, cycles.seed = "CPU", args.effort, args.seed
    cycles.use_adaptive_sampling, cycles.use_light_tree = False, True
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 1024
    cycles.transmission_bounces = cycles.transparent_max_bounces = 1024
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    cycles.use_denoising = args.denoise
    cycles.denoiser, cycles.denoising_input_passes = "OPENIMAGEDENOISE", "RGB_ALBEDO_NORMAL"


def main():
    args = peer.arguments(__doc__, "samples a pixel")
    with report.stage("load"), tempfile.TemporaryDirectory() as folder:
        scene, camera = peer.load(args)
        report.notes += scene.notes
        bpy.ops.wm.read_factory_settings(use_empty=True)
        build(scene, camera, Path(folder))
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.exr"
        settle(args, out)
        with report.stage("render"):
            bpy.ops.render.render(write_still=True)
        peer.write_exr(args.out, peer.read_exr(out), f"{Path(args.scene).name}, Cycles, {args.effort} spp, cd/m2")
    report.end(f"Cycles {bpy.app.version_string}", f"{args.effort} spp")


if __name__ == "__main__":
    main()
