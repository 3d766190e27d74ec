"""A glTF scene as a scene of Mitsuba 3. Import after `mitsuba.set_variant`."""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
from gltf import Unsupported, unit
from mitsuba_bsdf import GltfBsdf

NEAR = 1e-3  # m; Mitsuba wants a near plane beyond the eye


class KhrLamp(mi.Emitter):
    """Point and spot of KHR_lights_punctual: its own fall-off at the rim, and its range."""

    def __init__(self, light):
        super().__init__(mi.Properties("khr_lamp"))
        self.position = dr.opaque(mi.Point3f, list(light.position))
        self.axis = dr.opaque(mi.Vector3f, list(light.direction))
        self.intensity = dr.opaque(mi.Color3f, list(light.intensity))
        inner, outer = (math.cos(a) for a in (light.inner, light.outer))
        spot = light.kind == "spot"
        self.cos_outer = dr.opaque(mi.Float, outer if spot else -2.0)
        self.rim = dr.opaque(mi.Float, max(inner - outer, 0.001))
        self.per_range = dr.opaque(mi.Float, 1 / light.range)
        self.m_flags = mi.EmitterFlags.DeltaPosition
        self.m_needs_sample_2 = self.m_needs_sample_3 = False

    def sample_direction(self, it, sample, active=True):
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p, ds.n, ds.uv = self.position, mi.Normal3f(0), mi.Point2f(0)
        ds.time, ds.pdf, ds.delta = it.time, mi.Float(1), mi.Bool(True)
        ds.emitter = mi.EmitterPtr(self)
        ds.d = self.position - it.p
        ds.dist = dr.norm(ds.d)
        ds.d = ds.d / ds.dist
        cone = dr.square(dr.clip((-dr.dot(ds.d, self.axis) - self.cos_outer) / self.rim, 0, 1))
        window = dr.clip(1 - dr.square(dr.square(ds.dist * self.per_range)), 0, 1)
        return ds, dr.select(active, self.intensity * (cone * window / dr.square(ds.dist)), 0)

    def pdf_direction(self, it, ds, active=True):
        return mi.Float(0)

    def eval_direction(self, it, ds, active=True):
        return mi.Color3f(0)

    def eval(self, si, active=True):
        return mi.Color3f(0)

    def bbox(self):
        return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(self.position.numpy().ravel().tolist()))

    def to_string(self):
        return "KhrLamp[]"


class Builder:
    """A glTF scene on its way to Mitsuba; `notes` says what is modelled otherwise.

    With `guides` the film gets six layers more: albedo and normal of what is seen first, for a denoiser.
    """

    def __init__(self, scene, guides=False):
        self.scene, self.guides = scene, guides
        self.notes = list(scene.notes)
        low, high = scene.bounds()
        self.diagonal = float(np.linalg.norm(high - low))
        self.decoded = {}
        # Windows and alpha: shadow rays must pass them, as those of `volpath` do and those of `path` do not.
        self.see_through = False

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)

    def build(self, camera, size, depth):
        """The scene for `camera` (a name or None), a picture of `size`, roulette from `depth` bounces on."""
        result = {"type": "scene", "camera": self.sensor(self.scene.camera(camera), size)}
        for number, material in enumerate(self.scene.materials):
            meshes = [mesh for mesh in self.scene.meshes if mesh.material == number]
            # Those with tangents or colours apart from those without.
            kinds = {}
            for mesh in meshes:
                kinds.setdefault(_kind(mesh), []).append(mesh)
            for i, group in enumerate(kinds.values()):
                for k, shape in enumerate(self.shapes(material, group)):
                    result[f"shape_{number}_{i}_{k}"] = shape
        for i, light in enumerate(self.scene.lights):
            result[f"light{i}"] = self.light(light)
        kind = "volpath" if self.see_through else "path"
        integrator = {"type": kind, "max_depth": -1, "rr_depth": depth}
        if self.guides:
            integrator = {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "image": integrator}
        result["integrator"] = integrator
        return mi.load_dict(result)

    def sensor(self, camera, size):
        """The camera; the picture's aspect ratio counts, not the file's."""
        frame = np.eye(4)
        # Mitsuba looks along +z with +x to the left.
        scale = camera.ymag * size[0] / size[1] if camera.yfov is None else 1.0
        frame[:3, 0], frame[:3, 1], frame[:3, 2] = -scale * camera.right, scale * camera.up, -camera.back
        frame[:3, 3] = camera.position
        near = max(camera.near, NEAR)
        result = {
            "type": "orthographic" if camera.yfov is None else "perspective",
            "near_clip": near,
            "far_clip": near + 1e4,
            "to_world": mi.ScalarTransform4f(frame),
            "film": {
                "type": "hdrfilm",
                "width": size[0],
                "height": size[1],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "multijitter"},
        }
        if camera.yfov is not None:
            result |= {"fov": math.degrees(camera.yfov), "fov_axis": "y"}
        return result

    def shapes(self, material, meshes):
        """Meshes of one material and kind as one shape, or two, back to back, for a lamp with two sides."""
        if material.unlit:
            raise Unsupported(f"material {material.name!r} is unlit")
        positions = np.concatenate([m.positions for m in meshes])
        normals = np.concatenate([m.normals for m in meshes])
        offsets = np.cumsum([0] + [len(m.positions) for m in meshes])
        triangles = np.concatenate([m.triangles + o for m, o in zip(meshes, offsets)])
        a, b, c = (positions[triangles[:, k]].astype(np.float64) for k in range(3))
        faces = np.cross(b - a, c - a)
        # Without area there is nothing to meet, and no direction to a lamp.
        real = np.linalg.norm(faces, axis=1) > 0
        triangles, faces = triangles[real], unit(faces[real])
        if not len(triangles):
            return
        flat = bool((np.einsum("tki,ti->tk", normals[triangles], faces) > 0.9999).all())
        attributes = {}
        for name, values in (("colors", "colors"), ("tangent", "tangents")):
            if getattr(meshes[0], values) is not None:
                attributes[name] = np.concatenate([getattr(m, values) for m in meshes])
        sets = {texture.uv_set for texture in material.textures}
        if len(sets) > 1:
            raise Unsupported(f"material {material.name!r} uses both uv sets")
        # Without coordinates all is looked up at (0, 0).
        zeros = [np.zeros((len(m.positions), 2), np.float32) for m in meshes]
        uv = [m.uvs[i] if m.uvs[i] is not None else zero for i in sets for m, zero in zip(meshes, zeros)]
        uv = np.concatenate(uv) if uv else None
        # Mitsuba's lamps shine on the side of the shading normal; ours on that of the triangle.
        if material.is_emissive and not flat:
            attributes["smooth"] = normals
        vertex_normals = None if flat or material.is_emissive else normals
        copies = [(positions, triangles)]
        if material.is_emissive and material.double_sided:
            copies.append((positions - 1e-5 * self.diagonal * normals, triangles[:, ::-1]))
        for points, corners in copies:
            bsdf = self.bsdf(material, flat, attributes)
            emitter = self.emitter(material) if material.is_emissive else None
            yield _mesh(material.name, points, corners, vertex_normals, uv, attributes, bsdf, emitter)

    def emitter(self, material):
        """The light of an emissive material."""
        if material.emissive_texture is None:
            return mi.load_dict({"type": "area", "radiance": _rgb(material.emissive)})
        return mi.load_dict(
            {
                "type": "area",
                "radiance": self.texture(material.emissive_texture, "rgb", scale=material.emissive),
            }
        )

    def bsdf(self, material, flat, attributes):
        """Mitsuba's `diffuse` where that is the same, else `GltfBsdf`."""
        plain = flat and not attributes and material.is_lambert and material.alpha_mode == "OPAQUE"
        plain &= material.normal_texture is None and material.metallic_roughness_texture is None
        if plain:
            color = _rgb(material.base_color)
            if material.base_color_texture:
                color = self.texture(material.base_color_texture, "rgb", scale=material.base_color)
            return mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color}})
        maps = {}
        wanted = [
            ("base_color", material.base_color_texture, "rgb"),
            ("metallic_roughness", material.metallic_roughness_texture, "raw"),
            ("normal", material.normal_texture, "raw"),
            ("specular", material.specular_texture, "alpha"),
            ("specular_color", material.specular_color_texture, "rgb"),
            ("transmission", material.transmission_texture, "red"),
        ]
        if material.alpha_mode != "OPAQUE":
            wanted.append(("alpha", material.base_color_texture, "alpha"))
        for name, texture, channels in wanted:
            if texture is not None:
                maps[name] = mi.load_dict(self.texture(texture, channels))
        for name, attribute in (
            ("smooth", "smooth"),
            ("tangent", "tangent"),
            ("tangent_side", "tangent"),
            ("colors", "colors"),
            ("color_alpha", "colors"),
        ):
            if attribute in attributes:
                maps[name] = mi.load_dict({"type": "mesh_attribute", "name": f"vertex_{name}"})
        result = GltfBsdf(material, maps)
        self.see_through |= result.is_see_through
        return result

    def texture(self, texture, channels, scale=None):
        """A texture of Mitsuba: "rgb" (decoded from sRGB), "raw" (RGB as it is), "red" or "alpha"."""
        key = (texture.image, channels)
        if key not in self.decoded:
            self.decoded[key] = _decode(self.scene.images[texture.image], channels)
        pixels = self.decoded[key]
        if scale is not None:
            pixels = pixels * np.array(scale, np.float32)
        if texture.wrap_s != texture.wrap_t:
            self.note("a texture wraps differently along u and v: taken as along u")
        transform = np.eye(3)
        transform[:2] = texture.transform
        return {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(pixels)),
            "raw": True,
            "wrap_mode": texture.wrap_s,
            "filter_type": "bilinear" if texture.linear else "nearest",
            "to_uv": mi.ScalarTransform3f(transform),
        }

    def light(self, light):
        """A punctual light."""
        if light.kind == "directional":
            return {
                "type": "directional",
                "direction": list(light.direction),
                "irradiance": _rgb(light.intensity),
            }
        return KhrLamp(light)


def _kind(mesh):
    """What meshes must share to become one."""
    return mesh.colors is not None, mesh.tangents is not None


def _rgb(value):
    return {"type": "rgb", "value": [float(v) for v in value]}


def _decode(image, channels):
    """Pixels of an encoded image, float32 (height, width, 3 or 1)."""
    stream = mi.MemoryStream()
    stream.write(image.data)
    stream.seek(0)
    bitmap = mi.Bitmap(stream)
    Format, Type = mi.Bitmap.PixelFormat, mi.Struct.Type
    if channels == "rgb":
        return np.array(bitmap.convert(Format.RGB, Type.Float32, srgb_gamma=False))
    # As they are: told to be linear, they are not decoded.
    bitmap.set_srgb_gamma(False)
    if channels == "raw":
        return np.array(bitmap.convert(Format.RGB, Type.Float32, srgb_gamma=False))
    pixels = np.array(bitmap.convert(Format.RGBA, Type.Float32, srgb_gamma=False))
    return pixels[..., 3:] if channels == "alpha" else pixels[..., :1]


def _mesh(name, positions, triangles, normals, uv, attributes, bsdf, emitter):
    """A mesh of Mitsuba."""
    props = mi.Properties()
    props["bsdf"] = bsdf
    if emitter is not None:
        props["emitter"] = emitter
    mesh = mi.Mesh(
        name,
        vertex_count=len(positions),
        face_count=len(triangles),
        props=props,
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=uv is not None,
    )
    if "colors" in attributes:
        mesh.add_attribute("vertex_colors", 3, attributes["colors"][:, :3].ravel())
        mesh.add_attribute("vertex_color_alpha", 1, attributes["colors"][:, 3].ravel())
    if "tangent" in attributes:
        mesh.add_attribute("vertex_tangent", 3, attributes["tangent"][:, :3].ravel())
        mesh.add_attribute("vertex_tangent_side", 1, attributes["tangent"][:, 3].ravel())
    if "smooth" in attributes:
        mesh.add_attribute("vertex_smooth", 3, attributes["smooth"].ravel())
    params = mi.traverse(mesh)
    params["vertex_positions"] = positions.astype(np.float32).ravel()
    params["faces"] = triangles.astype(np.uint32).ravel()
    if normals is not None:
        params["vertex_normals"] = normals.astype(np.float32).ravel()
    if uv is not None:
        params["vertex_texcoords"] = uv.astype(np.float32).ravel()
    params.update()
    return mesh
