"""glTF 2.0 read for other renderers: a scene as plain arrays in world space, glTF's defaults filled in.

`load(path)` gives a `Scene`: what the file's default scene shows, metres, y up, photometric units. Read are
.gltf and .glb, buffers and images in the file, beside it or as data URIs, every kind of accessor
(interleaved, normalised, quantised, sparse), triangle lists, strips and fans, node hierarchies, several
primitives a mesh, KHR_lights_punctual, KHR_materials_{emissive_strength, ior, specular, transmission, unlit,
volume}, KHR_texture_transform, KHR_mesh_quantization. Not read: Draco, meshopt, skins, morph targets,
animations, instancing.

The camera: as in twolight, `yfov` is the angle over the picture's height and the picture's own aspect ratio
gives the width, whatever `aspect` the file states.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from gltf_file import File, Unsupported
from gltf_shape import face_normals, tangents, triangle_list, turn_to_front, unit, unshare

WRAPS = {10497: "repeat", 33648: "mirror", 33071: "clamp"}


@dataclass
class Image:
    """An encoded picture: the bytes of a PNG or JPEG."""

    name: str
    data: bytes

    @property
    def suffix(self):
        """What a file of it ends in, by the first bytes."""
        return ".png" if self.data[:4] == b"\x89PNG" else ".jpg"


@dataclass
class Texture:
    """An image as one material uses it, looked up at `transform @ (u, v, 1)` with v pointing down."""

    image: int  # index into Scene.images
    uv_set: int = 0  # index into Mesh.uvs
    transform: np.ndarray = field(default_factory=lambda: np.eye(2, 3))  # 2×3, KHR_texture_transform
    wrap_s: str = "repeat"  # "repeat", "mirror" or "clamp"
    wrap_t: str = "repeat"
    linear: bool = True  # filter between texels; else the nearest


@dataclass
class Material:
    """glTF's metallic-roughness and extensions. Colours are linear; a texture multiplies its factor."""

    name: str = "default"
    base_color: tuple = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    base_color_texture: Texture | None = None  # sRGB, alpha linear
    metallic: float = 1.0
    roughness: float = 1.0  # perceptual; GGX α is its square
    metallic_roughness_texture: Texture | None = None  # roughness in green, metallic in blue
    emissive: tuple = (0.0, 0.0, 0.0)  # cd/m², emissive strength multiplied in
    emissive_texture: Texture | None = None  # sRGB
    normal_texture: Texture | None = None  # tangent space
    normal_scale: float = 1.0
    alpha_mode: str = "OPAQUE"  # "OPAQUE", "MASK" or "BLEND"
    alpha_cutoff: float = 0.5
    double_sided: bool = False  # whether light is emitted to both sides
    unlit: bool = False
    ior: float = 1.5
    specular: float = 1.0
    specular_texture: Texture | None = None  # in alpha
    specular_color: tuple = (1.0, 1.0, 1.0)
    specular_color_texture: Texture | None = None  # sRGB
    transmission: float = 0.0
    transmission_texture: Texture | None = None  # in red
    thickness: float = 0.0  # > 0: bounds a volume and refracts (the mesh says how thick); 0: a thin wall
    attenuation_color: tuple = (1.0, 1.0, 1.0)
    attenuation_distance: float = math.inf  # m

    @property
    def textures(self):
        """Those it has."""
        return [value for value in vars(self).values() if isinstance(value, Texture)]

    @property
    def is_emissive(self):
        """Whether any light leaves it."""
        return max(self.emissive) > 0 and not self.unlit

    @property
    def is_lambert(self):
        """Whether it is wholly diffuse: neither metal nor coat nor transmission."""
        plain = self.metallic == 0 and self.transmission == 0 and (self.specular == 0 or self.ior == 1)
        return plain and not self.unlit

    @property
    def is_solid(self):
        """Whether it bounds a volume that refracts."""
        return self.transmission > 0 and self.thickness > 0


@dataclass
class Mesh:
    """One primitive where one node puts it, in world space; counter-clockwise triangles show their front."""

    name: str
    positions: np.ndarray  # (n, 3) float32, m
    normals: (
        np.ndarray
    )  # (n, 3) float32, unit, on the triangles' front; those of the faces where the file has none
    uvs: list  # TEXCOORD_0 and TEXCOORD_1: (n, 2) float32 or None
    colors: np.ndarray | None  # COLOR_0: (n, 4) float32, linear
    tangents: np.ndarray | None  # (n, 4) float32, w = ±1; present where the material has a normal map
    triangles: np.ndarray  # (m, 3) uint32
    material: int  # index into Scene.materials


@dataclass
class Light:
    """A lamp without extent (KHR_lights_punctual)."""

    name: str
    kind: str  # "point", "spot" or "directional"
    intensity: np.ndarray  # (3,) colour × intensity: cd, or lx for directional
    position: np.ndarray  # (3,) m
    direction: np.ndarray  # (3,) unit, the way the light travels
    inner: float = 0.0  # radians from the axis: where a spot's fall-off begins
    outer: float = math.pi / 4  # and ends
    range: float = math.inf  # m


@dataclass
class Camera:
    """Looks along −back; `right`, `up`, `back` are unit and orthogonal."""

    name: str
    position: np.ndarray
    right: np.ndarray
    up: np.ndarray
    back: np.ndarray
    yfov: float | None  # radians over the picture's height; None: orthographic
    ymag: float | None = None  # half the picture's height, m, if orthographic
    aspect: float | None = None  # width over height as the file states it; for information
    near: float = 0.0


@dataclass
class Scene:
    """What the file's default scene shows."""

    meshes: list
    materials: list
    images: list
    lights: list
    cameras: list
    notes: list  # what the file has that is left out, a sentence each

    def camera(self, name=None):
        """The camera called `name`, or of that number, or the first, or one that sees everything."""
        if not self.cameras:
            return self._framing()
        if name is None:
            return self.cameras[0]
        for camera in self.cameras:
            if camera.name == name:
                return camera
        if name.isdigit() and int(name) < len(self.cameras):
            return self.cameras[int(name)]
        raise Unsupported(f"no camera {name!r}; the file has {[camera.name for camera in self.cameras]}")

    def bounds(self):
        """Lowest and highest corner, m."""
        corners = [(m.positions.min(0), m.positions.max(0)) for m in self.meshes]
        return np.min([c[0] for c in corners], axis=0), np.max([c[1] for c in corners], axis=0)

    def _framing(self):
        low, high = self.bounds()
        centre, radius, yfov = 0.5 * (low + high), max(0.5 * np.linalg.norm(high - low), 1e-6), 0.7
        back = unit(np.array([0.35, 0.25, 1.0]))
        right = unit(np.cross([0.0, 1.0, 0.0], back))
        eye = centre + back * radius / math.sin(0.5 * yfov)
        return Camera("framing", eye, right, np.cross(back, right), back, yfov)


def load(path):
    """Reads a .gltf or .glb file. Raises `Unsupported` where the picture would be wrong."""
    return _Reader(Path(path)).scene()


class _Reader:
    """A file being read."""

    def __init__(self, path):
        self.file = File(path)
        self.json = self.file.json

    def scene(self):
        """Everything, flattened."""
        self.materials = [self._material(m, i) for i, m in enumerate(self.json.get("materials", []))]
        self.default_material = None
        meshes, lights, cameras = [], [], []
        for node, world in self._nodes():
            if "mesh" in node:
                mesh = self.json["meshes"][node["mesh"]]
                name = node.get("name") or mesh.get("name") or f"mesh {node['mesh']}"
                placed = [self._primitive(p, world, name) for p in mesh["primitives"]]
                meshes += [m for m in placed if m is not None]
                if "skin" in node:
                    self.file.note("skins are left out: meshes stand in their bind pose")
            if "camera" in node:
                cameras.append(self._camera(node, world))
            if "KHR_lights_punctual" in node.get("extensions", {}):
                lights.append(self._light(node, world))
        if not meshes:
            raise Unsupported("the scene shows no triangles")
        images = [self._image(image, i) for i, image in enumerate(self.json.get("images", []))]
        return Scene(meshes, self.materials, images, lights, cameras, self.file.notes)

    def _nodes(self):
        """Nodes of the default scene with their 4×4 transforms to the world, parents first."""
        nodes = self.json.get("nodes", [])
        if self.json.get("scenes"):
            roots = self.json["scenes"][self.json.get("scene", 0)].get("nodes", [])
        else:
            children = {c for node in nodes for c in node.get("children", [])}
            roots = [i for i in range(len(nodes)) if i not in children]
        stack = [(i, np.eye(4)) for i in reversed(roots)]
        while stack:
            i, parent = stack.pop()
            world = parent @ _local(nodes[i])
            yield nodes[i], world
            stack += [(c, world) for c in reversed(nodes[i].get("children", []))]

    def _primitive(self, primitive, world, name):
        """A `Mesh`, or None for points and lines."""
        attributes = {k: self.file.accessor(v).astype(np.float32) for k, v in primitive["attributes"].items()}
        positions = attributes["POSITION"]
        if "indices" in primitive:
            corners = self.file.accessor(primitive["indices"])[:, 0].astype(np.uint32)
        else:
            corners = np.arange(len(positions), dtype=np.uint32)
        triangles = triangle_list(primitive.get("mode", 4), corners)
        if triangles is None:
            self.file.note("points and lines are left out")
            return None
        linear = world[:3, :3]
        if np.linalg.det(linear) < 0:
            triangles = triangles[:, ::-1]  # a mirrored copy keeps its front outside
        material = primitive.get("material")
        if material is None:
            if self.default_material is None:
                self.default_material = len(self.materials)
                self.materials.append(Material())
            material = self.default_material
        mesh = Mesh(
            name=name,
            positions=(positions.astype(np.float64) @ linear.T + world[:3, 3]).astype(np.float32),
            normals=None,
            uvs=[attributes.get("TEXCOORD_0"), attributes.get("TEXCOORD_1")],
            colors=None,
            tangents=None,
            triangles=np.ascontiguousarray(triangles),
            material=material,
        )
        if "COLOR_0" in attributes:
            mesh.colors = np.ones((len(positions), 4), np.float32)
            mesh.colors[:, : attributes["COLOR_0"].shape[1]] = attributes["COLOR_0"].clip(0, 1)
        if "NORMAL" in attributes:
            # Cofactors, which exist for singular transforms too and turn with mirrored ones.
            cofactors = np.cross(np.roll(linear, -1, 0), np.roll(linear, -2, 0)) * np.sign(
                np.linalg.det(linear) or 1
            )
            mesh.normals = unit(attributes["NORMAL"].astype(np.float64) @ cofactors.T).astype(np.float32)
            if "TANGENT" in attributes:
                along = unit(attributes["TANGENT"][:, :3].astype(np.float64) @ linear.T)
                side = attributes["TANGENT"][:, 3:] * (-1 if np.linalg.det(linear) < 0 else 1)
                mesh.tangents = np.hstack([along, side]).astype(np.float32)
            turn_to_front(mesh)
        else:
            unshare(mesh, np.arange(len(mesh.triangles)))
            mesh.normals = np.repeat(face_normals(mesh), 3, axis=0).astype(np.float32)
        normal_map = self.materials[material].normal_texture
        if normal_map is None:
            mesh.tangents = None
        elif mesh.tangents is None and mesh.uvs[normal_map.uv_set] is not None:
            mesh.tangents = tangents(mesh, mesh.uvs[normal_map.uv_set])
        return mesh

    def _material(self, m, number):
        pbr, extensions = m.get("pbrMetallicRoughness", {}), m.get("extensions", {})
        specular = extensions.get("KHR_materials_specular", {})
        transmission = extensions.get("KHR_materials_transmission", {})
        volume = extensions.get("KHR_materials_volume", {})
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        color = pbr.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])
        return Material(
            name=m.get("name", f"material {number}"),
            base_color=tuple(color[:3]),
            alpha=color[3],
            base_color_texture=self._texture(pbr.get("baseColorTexture")),
            metallic=pbr.get("metallicFactor", 1.0),
            roughness=pbr.get("roughnessFactor", 1.0),
            metallic_roughness_texture=self._texture(pbr.get("metallicRoughnessTexture")),
            emissive=tuple(strength * e for e in m.get("emissiveFactor", [0.0, 0.0, 0.0])),
            emissive_texture=self._texture(m.get("emissiveTexture")),
            normal_texture=self._texture(m.get("normalTexture")),
            normal_scale=m.get("normalTexture", {}).get("scale", 1.0),
            alpha_mode=m.get("alphaMode", "OPAQUE"),
            alpha_cutoff=m.get("alphaCutoff", 0.5),
            double_sided=m.get("doubleSided", False),
            unlit="KHR_materials_unlit" in extensions,
            ior=extensions.get("KHR_materials_ior", {}).get("ior", 1.5),
            specular=specular.get("specularFactor", 1.0),
            specular_texture=self._texture(specular.get("specularTexture")),
            specular_color=tuple(specular.get("specularColorFactor", [1.0, 1.0, 1.0])),
            specular_color_texture=self._texture(specular.get("specularColorTexture")),
            transmission=transmission.get("transmissionFactor", 0.0),
            transmission_texture=self._texture(transmission.get("transmissionTexture")),
            thickness=volume.get("thicknessFactor", 0.0),
            attenuation_color=tuple(volume.get("attenuationColor", [1.0, 1.0, 1.0])),
            attenuation_distance=volume.get("attenuationDistance", math.inf),
        )

    def _texture(self, info):
        if info is None:
            return None
        texture = self.json["textures"][info["index"]]
        if "source" not in texture:
            self.file.note("textures in a format of an extension are left out")
            return None
        placed = info.get("extensions", {}).get("KHR_texture_transform", {})
        uv_set = placed.get("texCoord", info.get("texCoord", 0))
        if uv_set > 1:
            self.file.note("textures that use a uv set beyond TEXCOORD_1 are left out")
            return None
        sampler = self.json["samplers"][texture["sampler"]] if "sampler" in texture else {}
        (u, v), (su, sv), angle = (
            placed.get("offset", (0, 0)),
            placed.get("scale", (1, 1)),
            placed.get("rotation", 0),
        )
        cos, sin = math.cos(angle), math.sin(angle)
        filtering = sampler.get("magFilter", sampler.get("minFilter", 9729))
        return Texture(
            image=texture["source"],
            uv_set=uv_set,
            transform=np.array([[cos * su, sin * sv, u], [-sin * su, cos * sv, v]]),
            wrap_s=WRAPS[sampler.get("wrapS", 10497)],
            wrap_t=WRAPS[sampler.get("wrapT", 10497)],
            linear=filtering not in (9728, 9984, 9986),
        )

    def _image(self, image, number):
        data = (
            self.file.view(image["bufferView"])[0] if "bufferView" in image else self.file.uri(image["uri"])
        )
        return Image(image.get("name", f"image {number}"), bytes(data))

    def _light(self, node, world):
        light = self.json["extensions"]["KHR_lights_punctual"]["lights"][
            node["extensions"]["KHR_lights_punctual"]["light"]
        ]
        cone = light.get("spot", {})
        outer = min(cone.get("outerConeAngle", math.pi / 4), math.pi / 2)
        return Light(
            name=node.get("name") or light.get("name", "light"),
            kind=light["type"],
            intensity=light.get("intensity", 1.0) * np.array(light.get("color", [1.0, 1.0, 1.0])),
            position=world[:3, 3].copy(),
            direction=unit(-world[:3, 2]),
            inner=min(cone.get("innerConeAngle", 0.0), outer),
            outer=outer,
            range=light.get("range", math.inf),
        )

    def _camera(self, node, world):
        camera = self.json["cameras"][node["camera"]]
        lens = camera.get("perspective") or camera["orthographic"]
        flat = "perspective" not in camera
        back = unit(world[:3, 2])
        up = unit(world[:3, 1] - back * (back @ world[:3, 1]))
        return Camera(
            name=node.get("name") or camera.get("name", "camera"),
            position=world[:3, 3].copy(),
            right=np.cross(up, back),
            up=up,
            back=back,
            yfov=None if flat else lens["yfov"],
            ymag=abs(lens["ymag"]) if flat else None,
            aspect=abs(lens["xmag"] / lens["ymag"]) if flat else lens.get("aspectRatio"),
            near=max(lens.get("znear", 0.0), 0.0),
        )


def _local(node):
    """A node's own transform, 4×4."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    q = np.array(node.get("rotation", [0, 0, 0, 1]), np.float64)
    x, y, z, w = q / np.linalg.norm(q) if q.any() else (0, 0, 0, 1)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    result = np.eye(4)
    result[:3, :3] = rotation * np.array(node.get("scale", [1, 1, 1]), np.float64)
    result[:3, 3] = node.get("translation", [0, 0, 0])
    return result
