"""Renders a scene with Radiance: python xtask/peers/render_radiance.py SCENE OUT.exr --effort 1..6 ...

vwrays sends rays all over each pixel, rtrace follows them, and their mean is the picture. The same as in glTF:
triangles, shading normals, textures (the nearest texel), Lambertian surfaces, lamps that shine from their front, a
spot's cone and its rim, solid glass. What differs is in the notes of each picture.

Settings: every lamp is asked, no ray is dropped, 16 ambient bounces (8 in place of 3 cost 13 % more time in the
Cornell box and cure 1.8 % of missing light); the ambient cache is kept in memory, by each process its own.
"""

import math
import os
import subprocess
import tempfile
from pathlib import Path

import peer

try:
    import pyradiance
except ImportError:
    peer.missing("Radiance is not installed: cargo xtask peers install")
import numpy as np

report = peer.Report()

# By effort: rays a pixel, divisions of the hemisphere, super-samples there, accuracy of the ambient cache.
LADDER = {
    1: (2, 128, 0, 0.4),
    2: (4, 256, 0, 0.3),
    3: (8, 512, 128, 0.2),
    4: (16, 1024, 256, 0.15),
    5: (32, 2048, 512, 0.1),
    6: (64, 4096, 1024, 0.08),
}
# A mesh of more triangles does not become lamps, each of which every point would have to ask for its light.
LAMPS = 64


def run(name, *args, **pipes):
    """Runs a program of Radiance; returns what it printed."""
    folder = Path(pyradiance.__file__).parent
    environment = os.environ | {"RAYPATH": f".:{folder / 'lib'}", "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
    words = [str(folder / "bin" / name), *map(str, args)]
    pipes = {"stdout": subprocess.PIPE} | pipes
    return subprocess.run(words, env=environment, check=True, **pipes).stdout


def primitive(modifier, kind, name, strings=(), numbers=()):
    """A primitive of Radiance's scene language."""
    return (
        f"{modifier} {kind} {name}\n{len(strings)} {' '.join(map(str, strings))}\n0\n"
        f"{len(numbers)} {' '.join(format(float(x), '.9g') for x in numbers)}\n"
    )


def write_hdr(path, texels):
    """A Radiance picture, first row on top."""
    peak = texels.max(-1)
    exponent = np.where(peak > 0, np.floor(np.log2(np.maximum(peak, 1e-30))) + 1, -128)
    mantissa = np.clip(texels * 256 * 0.5 ** exponent[..., None], 0, 255)
    rgbe = np.concatenate([mantissa, exponent[..., None] + 128], -1).astype(np.uint8)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {texels.shape[0]} +X {texels.shape[1]}\n"
    path.write_bytes(head.encode() + rgbe.tobytes())


class World:
    """Radiance's scene: its text, and the files beside it in `folder`."""

    def __init__(self, scene, folder):
        self.scene, self.folder, self.text = scene, folder, []

    def add(self, *args, **more):
        self.text.append(primitive(*args, **more))

    def picture(self, name, texture, u, v):
        """A pattern of a texture at the expressions `u` and `v`; returns its name."""
        texels = peer.texels(self.scene, texture, linear=True)
        write_hdr(self.folder / f"{name}.hdr", texels)
        height, width = texels.shape[:2]
        least = min(width, height)
        if texture.wrap_s != "repeat" or texture.wrap_t != "repeat":
            report.note("Textures repeat.")
        place = [f"frac({u})*{width / least}", f"frac({v})*{height / least}"]
        self.add("void", "colorpict", name, ["red", "green", "blue", f"{name}.hdr", ".", *place])
        return name

    def material(self, i):
        """Defines what reflects in material `i`; returns its name."""
        m, name = self.scene.materials[i], f"m{i}"
        base, alpha, pattern = np.array(m.base_color), m.roughness**2, "void"
        if m.normal_texture:
            report.note("Normal maps are left out.")
        if m.base_color_texture:
            pattern = self.picture(f"p{i}", m.base_color_texture, "Lu", "Lv")
        if m.is_solid:
            left = np.ones(3)  # what a metre of it lets through
            if math.isfinite(m.attenuation_distance):
                left = np.array(m.attenuation_color) ** (1 / m.attenuation_distance)
            self.add("void", "dielectric", name, numbers=[*left, m.ior, 0])
        elif m.transmission > 0:
            # `glass` asks for the transmissivity of its inside; it has two surfaces and all reflections between them.
            report.note("Thin glass is `glass`, a pane with two surfaces and Fresnel's equations.")
            self.add(pattern, "glass", name, numbers=[*base, m.ior])
        elif m.metallic:
            if m.roughness > 0:
                report.note("Rough metal is Ward's, not GGX.")
            self.add(pattern, "metal", name, numbers=[*base, 1, alpha])
        else:
            gloss = 0 if m.is_lambert else m.specular * ((m.ior - 1) / (m.ior + 1)) ** 2
            if gloss:
                report.note("Glossy dielectrics are Ward's, not GGX.")
            self.add(pattern, "plastic", name, numbers=[*base, gloss, alpha if gloss else 0])
        if m.is_solid or m.metallic:
            report.note("Lamps seen by diffuse surfaces through glass or in mirrors give no light: no caustics.")
        return name

    def lamp(self, i, mesh):
        """Triangles that shine."""
        m, name = self.scene.materials[mesh.material], f"e{i}"
        pattern = "void"
        if m.emissive_texture:
            # Polygons carry no uv: fit it to the position.
            uv = peer.texture_uvs(mesh, m.emissive_texture).astype(np.float64)
            place = np.hstack([mesh.positions, np.ones((len(uv), 1))]).astype(np.float64)
            fit = np.linalg.lstsq(place, uv, rcond=None)[0]
            if np.abs(place @ fit - uv).max() > 1e-3:
                peer.beyond("a lamp with a texture that is not laid on flat")
            u, v = ("+".join(f"{c:.9g}*{p}" for c, p in zip(k, ("Px", "Py", "Pz", "1"))) for k in fit.T)
            pattern = self.picture(f"q{i}", m.emissive_texture, u.replace("+-", "-"), v.replace("+-", "-"))
        if m.double_sided:
            report.note("Lamps shine from their front only.")
        if max(m.base_color) > 0:
            report.note("Lamps reflect nothing.")
        if len(mesh.triangles) <= LAMPS:
            self.add(pattern, "light", name, numbers=m.emissive)
        else:
            report.note("Finely tessellated lamps are found by chance only.")
            self.add(pattern, "glow", name, numbers=[*m.emissive, 0])
        for k, corners in enumerate(mesh.positions[mesh.triangles]):
            self.add(name, "polygon", f"{name}-{k}", numbers=corners.ravel())

    def spot(self, i, light):
        """A KHR_lights_punctual lamp: a ball of 1 mm, a spot's cone a pattern on it."""
        if light.kind == "directional":
            self.add("void", "light", f"l{i}", numbers=light.intensity / (math.pi * math.radians(0.25) ** 2))
            self.add(f"l{i}", "source", f"s{i}", numbers=[*-light.direction, 0.5])
            return
        pattern = "void"
        if light.kind == "spot":
            inner, outer = math.cos(light.inner), math.cos(light.outer)
            x, y, z = -light.direction
            cos = f"({x:.9g}*Dx+{y:.9g}*Dy+{z:.9g}*Dz-{outer:.9g})/{max(inner - outer, 1e-3):.9g}".replace("+-", "-")
            pattern = f"b{i}"
            share = f"if({cos},if({cos}-1,1,({cos})*({cos})),0)"
            self.add("void", "brightfunc", pattern, [share, "."])
        radius = 1e-3
        self.add(pattern, "light", f"l{i}", numbers=light.intensity / (math.pi * radius**2))
        self.add(f"l{i}", "sphere", f"s{i}", numbers=[*light.position, radius])

    def shape(self, i, mesh, material):
        """Triangles that reflect, as a mesh of Radiance's own with normals and uv."""
        lines = [f"v {x:.8g} {y:.8g} {z:.8g}" for x, y, z in mesh.positions]
        lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.normals]
        m, form = self.scene.materials[mesh.material], "{0}//{0}"
        if m.base_color_texture:
            lines += [f"vt {u:.8g} {v:.8g}" for u, v in peer.texture_uvs(mesh, m.base_color_texture)]
            form = "{0}/{0}/{0}"
        lines += ["f " + " ".join(form.format(k + 1) for k in t) for t in mesh.triangles]
        (self.folder / f"s{i}.obj").write_text("\n".join(lines) + "\n")
        run("obj2mesh", f"s{i}.obj", f"s{i}.rtm", cwd=self.folder)
        self.add(material, "mesh", f"o{i}", [f"s{i}.rtm"])


def build(scene, folder):
    """Writes scene.oct into `folder`."""
    world, shining, area = World(scene, folder), 0.0, 0.0
    materials = {}
    for i, mesh in enumerate(scene.meshes):
        a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
        size = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        m = scene.materials[mesh.material]
        area += size
        if m.is_emissive:
            shining += size * max(m.base_color)
            world.lamp(i, mesh)
        else:
            if mesh.material not in materials:
                materials[mesh.material] = world.material(mesh.material)
            world.shape(i, mesh, materials[mesh.material])
    if shining > 0.2 * area:
        peer.beyond("walls that both shine and reflect: Radiance's lamps reflect nothing")
    for i, light in enumerate(scene.lights):
        world.spot(i, light)
    (folder / "scene.rad").write_text("\n".join(world.text))
    (folder / "scene.oct").write_bytes(run("oconv", "-r", 8192, "scene.rad", cwd=folder))


def render(camera, args, folder):
    """The picture: height × width × 3."""
    aspect = args.width / args.height
    half = math.tan(camera.yfov / 2)
    view = ["-vtv", "-vp", *camera.position, "-vd", *-camera.back, "-vu", *camera.up]
    view += ["-vv", math.degrees(camera.yfov), "-vh", math.degrees(2 * math.atan(half * aspect))]
    count, divisions, super_samples, accuracy = LADDER[args.effort]
    size = ["-pa", 0, "-x", args.width, "-y", args.height]
    settings = ["-ab", 16, "-ad", divisions, "-as", super_samples, "-aa", accuracy, "-ar", 512]
    settings += ["-n", args.threads, "-ds", 0, "-dj", 1, "-dt", 0, "-dc", 1]
    settings += ["-ss", 1, "-st", 0, "-lr", -10, "-lw", 1e-3, "-u+"]
    with open(folder / "rays", "wb") as file:
        run("vwrays", "-ff", "-c", count, "-pj", 1, *view, *size, stdout=file)
    with open(folder / "rays", "rb") as rays, open(folder / "light", "wb") as light:
        run("rtrace", "-h-", "-w", "-ff", *settings, "scene.oct", stdin=rays, stdout=light, cwd=folder)
    light = np.memmap(folder / "light", np.float32, "r", shape=(args.height, args.width, count, 3))
    return np.stack([row.mean(1, dtype=np.float64) for row in light])


def main():
    args = peer.arguments(__doc__, "quality, 1 to 6")
    if args.denoise:
        peer.beyond("Radiance has no denoiser")
    if args.effort not in LADDER:
        peer.beyond("the effort of Radiance goes from 1 to 6")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with report.stage("load"):
            scene, camera = peer.load(args)
            report.notes += scene.notes
            build(scene, folder)
        with report.stage("render"):
            pixels = render(camera, args, folder)
    peer.write_exr(args.out, pixels, f"{Path(args.scene).name}, Radiance, effort {args.effort}, cd/m2")
    report.end(run("rtrace", "-version").decode().strip().title(), f"effort {args.effort}")


if __name__ == "__main__":
    main()
