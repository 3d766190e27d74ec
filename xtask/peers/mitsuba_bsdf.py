"""glTF's materials as a BSDF of Mitsuba 3: the model that crates/geometry/src/bsdf describes, written anew.

    material   = mix(dielectric, metal, metallic)
    metal      = GGX reflection, Schlick with F0 = base colour
    dielectric = GGX coat over mix(diffuse base, transmission, transmission factor)

after glTF 2.0, appendix B, and KHR_materials_{ior, specular, transmission, volume}. The appendix leaves open
how coat and base share the light; here the base carries (1 − E(wo)) (1 − E(wi)) / (1 − E̅), E being the
coat's directional albedo (Kelemen and Szirmay-Kalos 2001). Below a roughness of 0.03 mirror and glass are
perfect. Glass with a volume uses Fresnel's equations, everything else Schlick's. What bounces between the
microfacets of metals is given back, to a narrow lobe or to the diffuse light; that of glass is lost. Reflection is from both sides; thin glass and what alpha leaves out let light straight
on; the light that a coloured volume swallows is taken off at the surface where it leaves, by the length of
the way there. (Of light that ends on something inside the volume nothing is taken off.)

Import after `mitsuba.set_variant`.
"""

import functools
import math

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba_layers import FAINT, SMOOTH_ROUGHNESS, Layers
from mitsuba_microfacets import Albedo, Ggx, fresnel

INDEX_MATCHED = 1e-3  # an index this near 1 is taken as straight
MIN_COS = 1e-3  # kept between the shading normal and both viewer and triangle
MAPS = [
    "base_color",  # linear
    "alpha",
    "metallic_roughness",
    "normal",
    "specular",
    "specular_color",  # linear
    "transmission",
    "colors",  # of vertices
    "color_alpha",
    "tangent",
    "tangent_side",  # w
    "smooth",  # vertex normals, where the mesh itself is told to be flat
]
F = mi.BSDFFlags


def lift(n, to):
    """`n` turned just enough toward `to` that their cosine is at least `MIN_COS`."""
    cos = dr.dot(n, to)
    flat = dr.normalize(n - to * cos)
    lifted = flat * math.sqrt(1 - MIN_COS**2) + to * MIN_COS
    return dr.select(cos >= MIN_COS, n, lifted)


class GltfBsdf(mi.BSDF):
    """A glTF material. `maps`: Mitsuba's textures by the names in `MAPS`, those there are."""

    albedo = None

    def __init__(self, m, maps):
        super().__init__(mi.Properties("gltf"))
        if GltfBsdf.albedo is None:
            GltfBsdf.albedo = Albedo()
        self.name, self.ior, self.is_solid = m.name, m.ior, m.is_solid
        self.is_matched = abs(m.ior - 1) < INDEX_MATCHED
        self.f0 = ((m.ior - 1) / (m.ior + 1)) ** 2
        # Opaque: kept as data rather than in the code, so that materials of one kind share a kernel.
        self.base_color = dr.opaque(mi.Color3f, list(m.base_color))
        self.alpha_factor = dr.opaque(mi.Float, m.alpha)
        self.metallic = dr.opaque(mi.Float, m.metallic)
        self.roughness = dr.opaque(mi.Float, m.roughness)
        self.specular = dr.opaque(mi.Float, 0.0 if m.ior == 1 else m.specular)
        self.specular_color = dr.opaque(mi.Color3f, list(m.specular_color))
        transmission = m.transmission if m.ior > 0 else 0.0
        self.transmission = dr.opaque(mi.Float, transmission)
        self.alpha_mode, self.alpha_cutoff = m.alpha_mode, m.alpha_cutoff
        self.normal_scale = m.normal_scale
        for name in MAPS:
            setattr(self, f"{name}_map", maps.get(name))

        self.has_metal, self.has_coat = m.metallic > 0, m.specular > 0 and m.ior != 1
        self.has_diffuse = transmission < 1 and (m.metallic < 1 or bool(self.metallic_roughness_map))
        self.has_diffuse |= bool(self.transmission_map)
        bright = m.metallic > 0 or max(self.f0 * c for c in m.specular_color) >= FAINT
        self.has_diffuse |= bright and m.roughness > 0.3  # what wide facets lose
        self.passes = transmission > 0 and m.metallic < 1
        self.has_specular = self.has_metal or self.has_coat or self.passes
        textured = bool(self.metallic_roughness_map)
        matched = self.is_solid and self.is_matched
        self.may_be_delta = self.has_specular and (textured or m.roughness < SMOOTH_ROUGHNESS or matched)
        self.may_be_rough = self.has_specular and m.roughness >= SMOOTH_ROUGHNESS and not matched
        self.straight = self.may_be_delta and self.passes and (not self.is_solid or self.is_matched)
        self.absorption = None
        if self.is_solid and math.isfinite(m.attenuation_distance):
            color = np.clip(m.attenuation_color, 1e-6, 1)
            self.absorption = dr.opaque(mi.Color3f, list(-np.log(color) / m.attenuation_distance))

        both = F.FrontSide | F.BackSide
        components = []
        if self.has_diffuse:
            components.append(F.DiffuseReflection | both)
        if self.may_be_rough:
            components.append(F.GlossyReflection | both)
            if self.passes:
                components.append(F.GlossyTransmission | both | F.NonSymmetric)
        if self.may_be_delta:
            components.append(F.DeltaReflection | both)
            if self.passes and not self.straight:
                components.append(F.DeltaTransmission | both | F.NonSymmetric)
        if self.is_see_through:
            components.append(F.Null | both)
        self.m_flags = functools.reduce(lambda a, b: a | b, components)
        self.m_components = components

    @property
    def is_see_through(self):
        """Whether rays may go straight on."""
        return self.straight or self.alpha_mode != "OPAQUE"

    def color(self, si, active):
        """Base colour and alpha: factor, texture and vertex colour."""
        color, alpha = mi.Color3f(self.base_color), mi.Float(self.alpha_factor)
        if self.base_color_map:
            color *= self.base_color_map.eval_3(si, active)
        if self.alpha_map:
            alpha *= self.alpha_map.eval_1(si, active)
        if self.colors_map:
            color *= self.colors_map.eval_3(si, active)
            alpha *= self.color_alpha_map.eval_1(si, active)
        return dr.minimum(color, 1), dr.clip(alpha, 0, 1)

    def coverage(self, alpha):
        """Share of the light that meets the surface at all."""
        if self.alpha_mode == "OPAQUE":
            return mi.Float(1)
        return dr.select(alpha >= self.alpha_cutoff, 1.0, 0.0) if self.alpha_mode == "MASK" else alpha

    def place(self, si, active):
        """Direction to the viewer, geometric and shading normal on its side, whether it sees the front."""
        wo = si.to_world(si.wi)
        front = dr.dot(si.n, wo) >= 0
        n = mi.Vector3f(si.sh_frame.n)
        if self.smooth_map:
            n = dr.normalize(mi.Vector3f(self.smooth_map.eval_3(si, active)))
        n = dr.select(dr.dot(n, si.n) < 0, -n, n)
        if self.normal_map and self.tangent_map:
            along = mi.Vector3f(self.tangent_map.eval_3(si, active))
            t = dr.normalize(along - n * dr.dot(n, along))
            b = dr.cross(n, t) * dr.sign(self.tangent_side_map.eval_1(si, active))
            texel = 2 * self.normal_map.eval_3(si, active) - 1
            mapped = (t * texel.x + b * texel.y) * self.normal_scale + n * dr.maximum(texel.z, 0)
            n = dr.normalize(mapped)
        side = dr.select(front, 1.0, -1.0)
        ng = mi.Vector3f(si.n) * side
        return wo, ng, lift(lift(n * side, ng), wo), front

    def through(self, si, front):
        """What a volume leaves of the light on its way here."""
        if self.absorption is None:
            return mi.Color3f(1)
        return dr.select(front, mi.Color3f(1), dr.exp(-self.absorption * si.t))

    def chance_of_diffuse(self, layers, cos_o):
        """By how much each way carries, about."""
        if not self.has_diffuse or not self.has_specular:
            return mi.Float(1.0 if self.has_diffuse else 0.0)
        diffuse = dr.max(layers.diffuse_share(cos_o))
        other = dr.max(layers.reflection(cos_o) + layers.passing(cos_o))
        return dr.select(diffuse + other > 0, diffuse / (diffuse + other), 1)

    def chance_of_reflection(self, layers, cos):
        """At a facet: reflect rather than pass."""
        if not self.passes:
            return mi.Float(1)
        reflected, passed = dr.max(layers.reflection(cos)), dr.max(layers.passing(cos))
        return dr.select(passed > 0, reflected / (reflected + passed), 1)

    def facet(self, eta, o, i):
        """The normal that refracts `o` into `i`, dωh/dωi, and whether it does (Walter 2007, eq. 17)."""
        h = dr.normalize(o * eta + i)
        h = dr.select(h.z < 0, -h, h)
        oh, ih = dr.dot(o, h), dr.dot(i, h)
        return h, -ih / dr.square(eta * oh + ih), (oh > 0) & (ih < 0)

    def value(self, layers, o, i, geometric):
        """f |cos θi| and the density of `i`, all but delta lobes; local directions, coverage left out."""
        same = (o.z > 0) & (i.z > 0) & (geometric > 0)
        f, pdf = mi.Color3f(0), mi.Float(0)
        diffuse = self.chance_of_diffuse(layers, o.z)
        if self.has_diffuse:
            f[same] = layers.diffuse(o.z, i.z)
            pdf[(o.z > 0) & (geometric > 0)] = diffuse * dr.maximum(i.z, 0) / math.pi
        if self.may_be_rough:
            rough = layers.alpha > 0
            ggx = Ggx(dr.maximum(layers.alpha, 1e-4))
            h = dr.normalize(o + i)
            oh = dr.dot(o, h)
            shape = ggx.d(h) / (4 * o.z)
            mirrored = rough & same
            g2 = 1 / (1 + ggx.hidden(o) + ggx.hidden(i))
            reflected = layers.reflection(oh) + layers.regained(oh, o.z, i.z)
            f[mirrored] += reflected * (shape * g2 / i.z)
            reflect = self.chance_of_reflection(layers, oh)
            pdf[mirrored] += (1 - diffuse) * reflect * shape * ggx.g1(o)
            if self.passes:
                other = rough & (o.z > 0) & (i.z < 0) & (geometric < 0)
                if self.is_solid:
                    h, jacobian, meets = self.facet(layers.eta, o, i)
                    other &= meets
                    oh = dr.dot(o, h)
                    density = oh * jacobian * ggx.d(h) / o.z
                    g2 = ggx.g1(o) * ggx.g1(i)
                    passed = layers.passing(oh) * (density * g2 / -i.z * dr.square(layers.eta))
                else:
                    j = mi.Vector3f(i.x, i.y, -i.z)
                    h = dr.normalize(o + j)
                    oh = dr.dot(o, h)
                    density = ggx.d(h) / (4 * o.z)
                    g2 = 1 / (1 + ggx.hidden(o) + ggx.hidden(j))
                    passed = layers.passing(oh) * (density * g2 / j.z)
                f[other] += passed
                pdf[other] += (
                    (1 - diffuse) * (1 - self.chance_of_reflection(layers, oh)) * density * ggx.g1(o)
                )
        return f * dr.abs(i.z), pdf

    def eval_pdf(self, ctx, si, wo, active=True):
        eye, ng, ns, front = self.place(si, active)
        layers, frame, light = Layers(self, si, front, active), mi.Frame3f(ns), si.to_world(wo)
        f, pdf = self.value(layers, frame.to_local(eye), frame.to_local(light), dr.dot(light, ng))
        good = active & dr.isfinite(pdf) & dr.all(dr.isfinite(f))
        f = f * self.through(si, front) * layers.coverage
        return dr.select(good, f, 0), dr.select(good, pdf * layers.coverage, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_null_transmission(self, si, active=True):
        if not self.is_see_through:
            return mi.Color3f(0)
        eye, _, ns, front = self.place(si, active)
        layers = Layers(self, si, front, active)
        beside = mi.Color3f(1 - layers.coverage)
        if self.straight:
            passed = layers.passing(dr.dot(eye, ns)) * self.through(si, front) * layers.coverage
            beside += dr.select(layers.alpha == 0, passed, 0)
        return dr.select(active, beside, 0)

    def eval_diffuse_reflectance(self, si, active=True):
        """A guide for denoisers: all that is reflected, mirrors and glass as white as they are."""
        eye, _, ns, front = self.place(si, active)
        layers = Layers(self, si, front, active)
        cos = dr.dot(eye, ns)
        total = layers.diffuse_share(cos) + layers.reflection(cos) + layers.passing(cos)
        return dr.select(active, dr.minimum(total, 1), 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        eye, ng, ns, front = self.place(si, active)
        layers, frame = Layers(self, si, front, active), mi.Frame3f(ns)
        o = frame.to_local(eye)
        bs, weight = dr.zeros(mi.BSDFSample3f), mi.Color3f(0)
        # In world space until the end.
        bs.wo, bs.eta, bs.sampled_type = mi.Vector3f(0, 0, 1), mi.Float(1), mi.UInt32(0)

        u, met = mi.Float(sample1), mi.Bool(True)
        if self.alpha_mode != "OPAQUE":
            met = u < layers.coverage
            u = dr.minimum(u / layers.coverage, 1 - 1e-7)
        diffuse = self.chance_of_diffuse(layers, o.z)
        by_base = met & (u < diffuse)
        if self.has_diffuse:
            bs.wo[by_base] = frame.to_world(mi.warp.square_to_cosine_hemisphere(sample2))
            bs.sampled_type[by_base] = mi.UInt32(+F.DiffuseReflection)
        u = dr.clip((u - diffuse) / (1 - diffuse), 0, 1 - 1e-7)
        if self.may_be_rough:
            self.scatter(bs, layers, frame, o, u, sample2, met & ~by_base & (layers.alpha > 0))
        f, pdf = self.value(layers, o, frame.to_local(bs.wo), dr.dot(bs.wo, ng))
        finite = bs.sampled_type != 0
        bs.pdf[finite] = pdf
        weight[finite] = dr.select(pdf > 0, f / pdf, 0)
        if self.may_be_delta:
            perfect = met & ~by_base & (layers.alpha == 0)
            share = self.send_on(bs, layers, eye, ns, ng, u, perfect)
            bs.pdf[perfect] *= 1 - diffuse
            weight[perfect] = share / (1 - diffuse)
        bs.pdf *= layers.coverage
        weight *= self.through(si, front)
        if self.alpha_mode != "OPAQUE":
            bs.wo[~met] = -eye
            bs.sampled_type[~met] = mi.UInt32(+F.Null)
            bs.pdf[~met] = 1 - layers.coverage
            weight[~met] = mi.Color3f(1)
        bs.wo = si.to_local(bs.wo)
        bs.sampled_component = mi.UInt32(0)
        good = active & (bs.pdf > 0) & dr.all(dr.isfinite(weight))
        bs.pdf = dr.select(good, bs.pdf, 0)
        return bs, dr.select(good, weight, 0)

    def scatter(self, bs, layers, frame, o, u, sample2, active):
        """Fills in direction and kind of `bs` where a rough facet reflects or passes the light."""
        h = Ggx(dr.maximum(layers.alpha, 1e-4)).visible(o, sample2)
        oh = dr.dot(o, h)
        mirrored = 2 * oh * h - o
        reflect = u < self.chance_of_reflection(layers, oh)
        up = active & reflect & (mirrored.z > 0)
        bs.wo[up] = frame.to_world(mirrored)
        bs.sampled_type[up] = mi.UInt32(+F.GlossyReflection)
        if not self.passes:
            return
        passed = mi.Vector3f(mirrored.x, mirrored.y, -mirrored.z)
        if self.is_solid:
            cos_t = fresnel(oh, layers.eta)[1]
            passed = dr.normalize(o * -layers.eta + h * (layers.eta * oh - cos_t))
        down = active & ~reflect & (passed.z < 0)
        bs.wo[down] = frame.to_world(passed)
        bs.sampled_type[down] = mi.UInt32(+F.GlossyTransmission)
        bs.eta[down] = 1 / layers.eta

    def send_on(self, bs, layers, eye, ns, ng, u, active):
        """Fills in `bs` where a perfect surface reflects or passes the light; returns share over chance."""
        cos = dr.dot(eye, ns)
        chance, share = self.chance_of_reflection(layers, cos), mi.Color3f(0)
        up = active & (u < chance)
        bs.wo[up] = self.fold(2 * cos * ns - eye, ng, 1)
        bs.sampled_type[up] = mi.UInt32(+F.DeltaReflection)
        bs.pdf[up] = chance
        share[up] = layers.reflection(cos) / chance
        if not self.passes:
            return share
        down = active & ~up
        passed, kind = -eye, F.Null
        if not self.straight:
            cos_t = fresnel(cos, layers.eta)[1]
            bent = dr.normalize(eye * -layers.eta + ns * (layers.eta * cos - cos_t))
            passed, kind = self.fold(bent, ng, -1), F.DeltaTransmission
        bs.wo[down] = passed
        bs.sampled_type[down] = mi.UInt32(+kind)
        bs.eta[down] = 1 / layers.eta
        bs.pdf[down] = 1 - chance
        share[down] = layers.passing(cos) * dr.square(layers.eta) / (1 - chance)
        return share

    @staticmethod
    def fold(w, ng, side):
        """A perfect ray that the shading normal sends to the wrong side: mirrored in the triangle's plane."""
        below = dr.dot(w, ng)
        return dr.select(below * side > 0, w, w - 2 * below * ng)

    def to_string(self):
        return f"GltfBsdf[{self.name}]"
