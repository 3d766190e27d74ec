"""Renders a scene with POV-Ray's radiosity: python xtask/peers/render_povray.py SCENE OUT.exr --effort 1..6 ...

The same as in glTF: triangles, shading normals, textures, Lambertian surfaces, parallelograms that shine (as area
lights whose points shine by Lambert's law), mirrors with Schlick's term, thin glass. What differs is in the notes of
each picture.

Measured in the Cornell box: direct light is right within 0.1 %, what is lit by reflected light alone up to 10 % too
dark (3.4 % of the picture's light), which neither more bounces nor smaller error bounds nor more samples cure.
"""

import dataclasses
import math
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import peer

report = peer.Report()

# By effort: rays of a radiosity sample, error bound, samples blended, bounces, finest pretrace step (share of the
# picture), samples across a pixel, points across an area light.
LADDER = {
    1: (100, 0.8, 5, 4, 0.02, 1, 4),
    2: (200, 0.5, 8, 6, 0.01, 2, 4),
    3: (400, 0.35, 10, 8, 0.006, 2, 8),
    4: (800, 0.25, 10, 10, 0.004, 3, 8),
    5: (1600, 0.18, 15, 15, 0.003, 3, 12),
    6: (1600, 0.12, 20, 20, 0.002, 4, 16),
}
# POV-Ray's 1 in cd/m²: keeps pictures within the range of its half floats.
UNIT = 100.0
# It dims light by 2/(1 + (d/FADE)²), which is the inverse square from a few centimetres on.
FADE = 1e-3


def v(values):
    """A vector."""
    return "<" + ",".join(f"{x:.9g}" for x in np.asarray(values, np.float64).ravel()) + ">"


def rows(name, array):
    """A list of vectors in a mesh2."""
    return f"{name} {{ {len(array)}, " + ",\n".join(map(v, array)) + " }"


def source(position, intensity, rest):
    """A light source of `intensity` cd; `rest` says of which kind."""
    color = np.asarray(intensity) / (math.pi * 2 * FADE**2 * UNIT)
    return f"light_source {{ {v(position)} rgb {v(color)} fade_distance {FADE} fade_power 2 {rest} }}"


class World:
    """The scene as POV-Ray's text, and the images beside it in `folder`."""

    def __init__(self, scene, folder, points):
        self.scene, self.folder, self.points, self.text = scene, folder, points, []
        area = {i: self.area(mesh).sum() for i, mesh in enumerate(scene.meshes)}
        shining = sum(a for i, a in area.items() if scene.materials[scene.meshes[i].material].is_emissive)
        # Where the walls shine, radiosity finds their light better than shadow rays.
        self.walls_shine = shining > 0.2 * sum(area.values())

    @staticmethod
    def area(mesh):
        a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    def image(self, texture):
        """A pigment of a texture."""
        image = self.scene.images[texture.image]
        path = self.folder / f"{texture.image}{image.suffix}"
        path.write_bytes(image.data)
        kind = "png" if image.suffix == ".png" else "jpeg"
        once = " once" if texture.wrap_s == "clamp" else ""
        return f'uv_mapping pigment {{ image_map {{ {kind} "{path.name}"{once} interpolate 2 }} }}'

    def texture(self, m):
        """What material `m` does with light, as a texture and an interior."""
        pigment, finish, interior = f"pigment {{ rgb {v(m.base_color)} }}", "diffuse 1", ""
        if m.base_color_texture:
            pigment, finish = self.image(m.base_color_texture), "diffuse 1"
            if min(m.base_color) < 1:
                report.note("Factors on textures are left out.")
        if m.normal_texture:
            report.note("Normal maps are left out.")
        f0 = m.specular * ((m.ior - 1) / (m.ior + 1)) ** 2
        if m.is_solid:
            report.note("Light goes straight through solid glass: no caustics.")
            pigment, interior = "pigment { rgbf 1 }", f"ior {m.ior}"
            finish = "diffuse 0 reflection { 0, 1 fresnel on } conserve_energy"
            if math.isfinite(m.attenuation_distance):
                left = np.array(m.attenuation_color)
                mean = -m.attenuation_distance / math.log(left.mean())
                interior += f" fade_distance {mean:.9g} fade_power 1001 fade_color rgb {v(left / left.max() * 0.1)}"
                report.note("The tint of glass is rough.")
        elif m.transmission > 0:
            pigment = f"pigment {{ rgbf {v([*m.base_color, 1])} }}"
            finish = f"diffuse 0 reflection {{ {f0}, 1 falloff 5 }} conserve_energy"
        elif m.metallic:
            if m.roughness > 0:
                report.note("Rough metals are mirrors.")
            finish = f"diffuse 0 reflection {{ rgb {v(m.base_color)}, rgb 1 falloff 5 }}"
        elif not m.is_lambert:
            report.note("Glossy dielectrics have no gloss.")
        if m.is_emissive:
            base = np.array(m.base_color)
            if m.emissive_texture or base.min() == 0:
                pigment = self.image(m.emissive_texture) if m.emissive_texture else "pigment { rgb 1 }"
                base, finish = np.ones(3), "diffuse 0"
            finish += f" emission rgb {v(np.array(m.emissive) / base / UNIT)}"
        text = f"texture {{ {pigment} finish {{ ambient 0 {finish} }} }}"
        return text + (f" interior {{ {interior} }}" if interior else "")

    def shape(self, mesh):
        """A mesh, and the light sources of one that shines."""
        m = self.scene.materials[mesh.material]
        parts = [rows("vertex_vectors", mesh.positions), rows("normal_vectors", mesh.normals)]
        textures = [t for t in (m.base_color_texture, m.emissive_texture) if t]
        if textures:
            parts.append(rows("uv_vectors", peer.texture_uvs(mesh, textures[0])))
        parts.append(rows("face_indices", mesh.triangles))
        flags = ""
        if m.is_emissive:
            report.note("Lamps shine to both sides where they are seen.")
            if not self.walls_shine:
                self.lamps(mesh, m)
                # Radiosity must not find again what the sources give, and they stand on their lamp.
                flags = "no_radiosity no_shadow"
                report.note("Lamps cast no shadows.")
                dark = self.texture(dataclasses.replace(m, emissive=(0.0, 0.0, 0.0)))
                self.text.append(f"mesh2 {{ {' '.join(parts)} {dark} no_image no_reflection no_shadow }}")
        self.text.append(f"mesh2 {{ {' '.join(parts)} {self.texture(m)} {flags} }}")

    def lamps(self, mesh, m):
        """Light sources in place of triangles that shine."""
        radiance = np.array(m.emissive)
        if m.emissive_texture:
            radiance = radiance * peer.texels(self.scene, m.emissive_texture, linear=True).mean((0, 1))
            report.note("Lamps with a texture shine with its mean.")
        area = self.area(mesh)
        if len(area) > 64:
            # A convex body shows a quarter of its surface on average.
            middle = 0.5 * (mesh.positions.max(0) + mesh.positions.min(0))
            across = math.sqrt(area.sum() / math.pi)
            n = self.points
            disc = f"area_light x*{across:.6g}, y*{across:.6g}, {n}, {n} adaptive 1 jitter circular orient"
            self.text.append(source(middle, radiance * area.sum() / 4, disc))
            report.note("Finely tessellated lamps shine as balls.")
            return
        corners = mesh.positions[mesh.triangles].astype(np.float64)
        while len(corners):
            first, rest = corners[0], corners[1:]
            for k, other in enumerate(rest):
                shared = [p for p in first if (np.abs(other - p).max(1) < 1e-6).any()]
                if len(shared) == 2:
                    lone = next(p for p in first if not any((p == q).all() for q in shared))
                    if np.abs(other - (sum(shared) - lone)).max(1).min() < 1e-5:
                        self.panel(lone, shared[0] - lone, shared[1] - lone, first, radiance)
                        corners = np.delete(rest, k, axis=0)
                        break
            else:
                peer.beyond("lamps that are neither parallelograms nor finely tessellated")

    def panel(self, corner, along, across, triangle, radiance):
        """A parallelogram that shines from its front."""
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        normal /= np.linalg.norm(normal)
        area = np.linalg.norm(np.cross(along, across))
        middle = corner + 0.5 * (along + across) + 1e-4 * normal
        n = self.points
        # POV-Ray spreads n points from edge to edge: each should stand in the middle of its share.
        along, across = along * (n - 1) / n, across * (n - 1) / n
        rest = f"spotlight point_at {v(middle + normal)} radius 89.9999 falloff 90 tightness 1"
        rest += f" area_light {v(along)}, {v(across)}, {n}, {n} jitter area_illumination on"
        self.text.append(source(middle, radiance * area, rest))

    def lamp(self, light):
        """A KHR_lights_punctual lamp."""
        if light.kind == "directional":
            at = -1e4 * light.direction
            color = np.asarray(light.intensity) / (math.pi * UNIT)
            self.text.append(f"light_source {{ {v(at)} rgb {v(color)} parallel point_at 0 }}")
            return
        rest = ""
        if light.kind == "spot":
            # Its rim is t²(3 − 2t), glTF's t²: made 2/3 as wide, it carries the same flux.
            inner, outer = math.cos(light.inner), math.cos(light.outer)
            narrowed = math.degrees(math.acos(inner - 2 / 3 * (inner - outer)))
            rest = f"spotlight point_at {v(light.position + light.direction)} tightness 0"
            rest += f" radius {math.degrees(light.inner):.9g} falloff {narrowed:.9g}"
            report.note("A spot's rim is that of POV-Ray, narrowed to the same flux.")
        self.text.append(source(light.position, light.intensity, rest))


def build(scene, camera, args, folder):
    """Writes scene.pov into `folder`."""
    count, error, nearest, bounces, step, _, points = LADDER[args.effort]
    world = World(scene, folder, points)
    tan = math.tan(camera.yfov / 2)
    world.text += [
        "#version 3.7;",
        "global_settings { assumed_gamma 1 adc_bailout 0.0005 max_trace_level 32 radiosity { brightness 1"
        f" gray_threshold 0 pretrace_start 0.08 pretrace_end {step} count {count} error_bound {error}"
        f" nearest_count {nearest} low_error_factor 0.6 recursion_limit {bounces} minimum_reuse 0.003 }} }}",
        f"camera {{ perspective location {v(camera.position)} direction {v(-camera.back)} up {v(2 * tan * camera.up)}"
        f" right {v(2 * tan * args.width / args.height * camera.right)} }}",
    ]
    for mesh in scene.meshes:
        world.shape(mesh)
    for light in scene.lights:
        world.lamp(light)
    (folder / "scene.pov").write_text("\n".join(world.text))


def main():
    args = peer.arguments(__doc__, "quality, 1 to 6")
    povray = shutil.which("povray")
    if povray is None:
        peer.missing("POV-Ray is not installed: apt install povray")
    if args.denoise:
        peer.beyond("POV-Ray has no denoiser")
    if args.effort not in LADDER:
        peer.beyond("the effort of POV-Ray goes from 1 to 6")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with report.stage("load"):
            scene, camera = peer.load(args)
            report.notes += scene.notes
            build(scene, camera, args, folder)
        across = LADDER[args.effort][5]
        words = [povray, "+Iscene.pov", "+Oout.exr", "+FE", f"+W{args.width}", f"+H{args.height}", "-D"]
        words += [f"+WT{args.threads}", *(["+AM1", "+A0.0", f"+R{across}", "-J"] if across > 1 else ["-A"])]
        with report.stage("render"):
            run = subprocess.run(words, cwd=folder, capture_output=True, text=True)
        if run.returncode:
            raise SystemExit(run.stderr[-2000:])
        pixels = peer.read_exr(folder / "out.exr") * UNIT
    peer.write_exr(args.out, pixels, f"{Path(args.scene).name}, POV-Ray, effort {args.effort}, cd/m2")
    version = re.search(r"Version (\S+)", run.stderr)
    report.end(f"POV-Ray {version[1] if version else ''}".strip(), f"effort {args.effort}")


if __name__ == "__main__":
    main()
