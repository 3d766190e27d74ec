"""glTF's materials as a BSDF of Mitsuba 3: the model that twolight's crates/geometry/src/bsdf/ describes, written anew.

    material   = mix(dielectric, metal, metallic)
    metal      = GGX reflection, Schlick with F0 = base colour
    dielectric = GGX coat over mix(diffuse base, transmission, transmission factor)

after glTF 2.0, appendix B, and KHR_materials_{ior, specular, transmission, volume}. The appendix leaves open how coat
and base share the light; here the base carries (1 − E(wo)) (1 − E(wi)) / (1 − E̅), E being the coat's directional
albedo (Kelemen and Szirmay-Kalos 2001). Below a roughness of 0.03 mirror and glass are perfect. Glass with a volume
uses Fresnel's equations, everything else Schlick's. Light is scattered once between microfacets. Reflection is from
both sides; thin glass and what alpha leaves out let light straight on; the light that a coloured volume swallows is
taken off at the surface where it leaves, by the length of the way there.

Import after `mitsuba.set_variant`.
"""

import functools
import math

import drjit as dr
import mitsuba as mi
import numpy as np

SMOOTH_ROUGHNESS = 0.03
INDEX_MATCHED = 1e-3  # an index this near 1 is taken as straight
MIN_COS = 1e-3  # kept between the shading normal and both viewer and triangle
ROWS, COLUMNS = 33, 65  # of the table of albedos, by √α and √cos
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


def schlick_weight(cos):
    """(1 − cos)⁵."""
    m = dr.clip(1 - cos, 0, 1)
    return dr.square(dr.square(m)) * m


def schlick(f0, cos):
    """Schlick's Fresnel term."""
    return f0 + (1 - f0) * schlick_weight(cos)


def fresnel(cos_i, eta):
    """Fresnel's equations for unpolarised light; `eta` is n on the incident side over n beyond. 1 beyond the
    critical angle. Also the cosine on the far side."""
    cos2 = (1 - eta) * (1 + eta) + dr.square(eta * cos_i)
    cos_t = dr.safe_sqrt(dr.minimum(cos2, 1))
    s = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    f = dr.select(cos2 >= 0, 0.5 * (dr.square(s) + dr.square(p)), 1)
    return dr.select(eta == 1, 0, f), cos_t


class Ggx:
    """Isotropic GGX with Smith's shadowing (Walter et al. 2007, Heitz 2014), z along the normal."""

    def __init__(self, alpha):
        self.alpha = alpha

    def d(self, h):
        """Density of normals, 1/sr."""
        a2 = dr.square(self.alpha)
        return a2 / (math.pi * dr.square(a2 * dr.square(h.z) + dr.square(h.x) + dr.square(h.y)))

    def hidden(self, w):
        """Λ: the area of hidden facets over that of visible ones."""
        x = dr.square(self.alpha) * (dr.square(w.x) + dr.square(w.y)) / dr.maximum(dr.square(w.z), 1e-20)
        return 0.5 * x / (1 + dr.sqrt(1 + x))

    def g1(self, w):
        """Share of facets visible from `w`."""
        return 1 / (1 + self.hidden(w))

    def visible(self, wo, u):
        """A normal as often as it is seen from `wo` (Dupuy and Benyoub 2023)."""
        s = dr.normalize(mi.Vector3f(wo.x * self.alpha, wo.y * self.alpha, wo.z))
        z = dr.fma(1 - u.y, 1 + s.z, -s.z)
        sin, cos = dr.sincos(2 * math.pi * u.x)
        r = dr.safe_sqrt(1 - dr.square(z))
        h = mi.Vector3f(r * cos + s.x, r * sin + s.y, z + s.z)
        return dr.normalize(mi.Vector3f(h.x * self.alpha, h.y * self.alpha, dr.maximum(h.z, 1e-7)))


@functools.cache
def albedo_table():
    """Directional albedo of GGX reflection: for (√α, √cos) the means of G2/G1 and G2/G1 (1 − V·H)⁵, as a flat array
    (rows · columns, 2), and for each row their averages over the cosine-weighted hemisphere, (rows, 2)."""
    n = 48
    u, v = ((np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(-1, 2) + 0.5) / n).T
    table = np.empty((ROWS, COLUMNS, 2))
    for row in range(ROWS):
        alpha = max((row / (ROWS - 1)) ** 2, 1e-4)
        for column in range(COLUMNS):
            cos = max((column / (COLUMNS - 1)) ** 2, 1e-5)
            o = np.array([math.sqrt(1 - cos * cos), 0, cos])
            s = o * [alpha, alpha, 1]
            s /= np.linalg.norm(s)
            z = (1 - v) * (1 + s[2]) - s[2]
            r = np.sqrt(np.maximum(1 - z * z, 0))
            h = np.stack([r * np.cos(2 * np.pi * u) + s[0], r * np.sin(2 * np.pi * u), z + s[2]], -1)
            h *= [alpha, alpha, 1]
            h /= np.linalg.norm(h, axis=-1, keepdims=True)
            oh = h @ o
            i = 2 * oh[:, None] * h - o

            def hidden(w):
                x = alpha**2 * (w[..., 0] ** 2 + w[..., 1] ** 2) / np.maximum(w[..., 2] ** 2, 1e-20)
                return 0.5 * x / (1 + np.sqrt(1 + x))

            weight = np.where(i[:, 2] > 0, (1 + hidden(o)) / (1 + hidden(o) + hidden(i)), 0)
            table[row, column] = weight.mean(), (weight * np.clip(1 - oh, 0, 1) ** 5).mean()
    # With μ = x², 2 ∫ E μ dμ = 4 ∫ E x³ dx over the interpolated table, so that the base loses just what the coat has.
    x = (np.arange((COLUMNS - 1) * 32) + 0.5) / 32
    left, t = x.astype(int), (x % 1)[:, None]
    between = table[:, left] * (1 - t) + table[:, left + 1] * t
    weights = 4 * (x / (COLUMNS - 1)) ** 3 / len(x)
    return table.reshape(-1, 2), np.einsum("rck,c->rk", between, weights)


class Albedo:
    """The table on the device."""

    def __init__(self):
        table, means = albedo_table()
        self.table, self.means = (
            mi.Float(np.ascontiguousarray(a.ravel(), np.float32)) for a in (table, means)
        )
        dr.make_opaque(self.table, self.means)

    @staticmethod
    def _split(x, n):
        x = dr.clip(x, 0, 1) * (n - 1)
        i = dr.minimum(mi.UInt32(x), n - 2)
        return i, x - mi.Float(i)

    def directional(self, alpha, cos, f0, active):
        """Share of uniform light that a coat of width `alpha` and `f0` sends toward `cos`."""
        row, t = self._split(dr.sqrt(alpha), ROWS)
        column, s = self._split(dr.safe_sqrt(cos), COLUMNS)
        at = lambda r, c: dr.gather(mi.Vector2f, self.table, r * COLUMNS + c, active)
        low = dr.lerp(at(row, column), at(row, column + 1), s)
        high = dr.lerp(at(row + 1, column), at(row + 1, column + 1), s)
        e = dr.lerp(low, high, t)
        rough = f0 * (e.x - e.y) + e.y
        return dr.select(alpha == 0, f0 + (1 - f0) * schlick_weight(cos), rough)

    def mean(self, alpha, f0, active):
        """The same averaged over the cosine-weighted hemisphere."""
        row, t = self._split(dr.sqrt(alpha), ROWS)
        at = lambda r: dr.gather(mi.Vector2f, self.means, r, active)
        e = dr.lerp(at(row), at(row + 1), t)
        rough = f0 * (e.x - e.y) + e.y
        return dr.select(alpha == 0, f0 + (1 - f0) / 21, rough)


class Layers:
    """How strong each lobe is at the points of a wavefront; see `layers.rs`."""

    def __init__(self, bsdf, si, front, active):
        color, alpha_channel = bsdf.color(si, active)
        metallic, roughness = bsdf.metallic, bsdf.roughness
        if bsdf.metallic_roughness_map:
            texel = bsdf.metallic_roughness_map.eval_3(si, active)
            roughness, metallic = roughness * texel.y, metallic * texel.z
        specular = bsdf.specular
        if bsdf.specular_map:
            specular = specular * bsdf.specular_map.eval_1(si, active)
        tint = bsdf.specular_color
        if bsdf.specular_color_map:
            tint = tint * bsdf.specular_color_map.eval_3(si, active)
        transmission = bsdf.transmission
        if bsdf.transmission_map:
            transmission = transmission * bsdf.transmission_map.eval_1(si, active)
        self.color, self.metal, self.specular, self.tint = color, metallic, specular, mi.Color3f(tint)
        dielectric = 1 - metallic
        self.solid = dielectric * transmission if bsdf.is_solid else mi.Float(0)
        self.thin = mi.Float(0) if bsdf.is_solid else dielectric * transmission
        self.coat = dielectric - self.solid
        smooth = roughness < SMOOTH_ROUGHNESS
        if bsdf.is_matched:
            smooth |= self.solid > 0
        self.alpha = dr.select(smooth, 0, dr.square(roughness))
        self.eta = mi.Float(1)
        if bsdf.is_solid and not bsdf.is_matched:
            self.eta = dr.select(front, 1 / bsdf.ior, bsdf.ior)
        self.f0 = dr.minimum(self.tint * bsdf.f0, 1)
        self.base = color * (dielectric * (1 - transmission))
        self.coverage = bsdf.coverage(alpha_channel)
        self.bsdf, self.active = bsdf, active
        self.f0_most = dr.max(self.f0)
        if bsdf.has_coat:
            self.mean_passed = 1 - specular * bsdf.albedo.mean(self.alpha, self.f0_most, active)
            self.base = dr.select(self.mean_passed > 1e-4, self.base, 0)

    def passed(self, cos):
        """1 − E: what gets past the coat."""
        if not self.bsdf.has_coat:
            return mi.Float(1)
        e = self.bsdf.albedo.directional(self.alpha, cos, self.f0_most, self.active)
        return dr.maximum(1 - self.specular * e, 0)

    def diffuse(self, cos_o, cos_i):
        """f of the base, 1/sr."""
        f = self.base / math.pi
        if self.bsdf.has_coat:
            f = f * (self.passed(cos_o) * self.passed(cos_i) / self.mean_passed)
        return f

    def _glass(self, cos):
        f = fresnel(cos, self.eta)[0]
        return dr.select(f >= 1, mi.Color3f(1), dr.minimum(self.tint * f, 1) * self.specular)

    def reflection(self, cos):
        """Share that a microfacet reflects."""
        total = schlick(self.color, cos) * self.metal + schlick(self.f0, cos) * (self.coat * self.specular)
        if self.bsdf.is_solid:
            total += self._glass(cos) * self.solid
        return total

    def passing(self, cos):
        """Share that a microfacet lets through, without radiance's η²."""
        if self.bsdf.is_solid:
            return self.color * (self.solid * (1 - dr.max(self._glass(cos))))
        return self.color * (self.thin * (1 - self.specular * dr.max(schlick(self.f0, cos))))


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
        """Direction to the viewer, geometric and shading normal on its side, and whether it sees the front."""
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
        diffuse = dr.max(layers.base) * layers.passed(cos_o)
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
            f[mirrored] += layers.reflection(oh) * (shape * g2 / i.z)
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
        total = layers.base * layers.passed(cos) + layers.reflection(cos) + layers.passing(cos)
        return dr.select(active, dr.minimum(total, 1), 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        eye, ng, ns, front = self.place(si, active)
        layers, frame = Layers(self, si, front, active), mi.Frame3f(ns)
        o = frame.to_local(eye)
        bs, weight = dr.zeros(mi.BSDFSample3f), mi.Color3f(0)
        bs.eta = mi.Float(1)
        light, kind = mi.Vector3f(0, 0, 1), mi.UInt32(0)
        delta = mi.Bool(False)

        u = mi.Float(sample1)
        met = mi.Bool(True)
        if self.alpha_mode != "OPAQUE":
            met = u < layers.coverage
            u = dr.minimum(u / layers.coverage, 1 - 1e-7)
        diffuse = self.chance_of_diffuse(layers, o.z)
        by_base = met & (u < diffuse)
        if self.has_diffuse:
            light[by_base] = frame.to_world(mi.warp.square_to_cosine_hemisphere(sample2))
            kind[by_base] = mi.UInt32(+F.DiffuseReflection)
        if self.has_specular:
            by_facet = met & ~by_base
            u = dr.clip((u - diffuse) / (1 - diffuse), 0, 1 - 1e-7)
            if self.may_be_rough:
                rough = by_facet & (layers.alpha > 0)
                h = Ggx(dr.maximum(layers.alpha, 1e-4)).visible(o, sample2)
                oh = dr.dot(o, h)
                mirrored = 2 * oh * h - o
                reflect = u < self.chance_of_reflection(layers, oh)
                up = rough & reflect & (mirrored.z > 0)
                light[up] = frame.to_world(mirrored)
                kind[up] = mi.UInt32(+F.GlossyReflection)
                if self.passes:
                    if self.is_solid:
                        cos_t = fresnel(oh, layers.eta)[1]
                        passed = dr.normalize(o * -layers.eta + h * (layers.eta * oh - cos_t))
                    else:
                        passed = mi.Vector3f(mirrored.x, mirrored.y, -mirrored.z)
                    down = rough & ~reflect & (passed.z < 0)
                    light[down] = frame.to_world(passed)
                    kind[down] = mi.UInt32(+F.GlossyTransmission)
                    bs.eta[down] = 1 / layers.eta
            if self.may_be_delta:
                chance = self.chance_of_reflection(layers, o.z)
                perfect = by_facet & (layers.alpha == 0)
                up = perfect & (u < chance)
                light[up] = self.fold(2 * o.z * ns - eye, ng, 1)
                kind[up] = mi.UInt32(+F.DeltaReflection)
                weight[up] = layers.reflection(o.z) / (chance * (1 - diffuse))
                bs.pdf[up] = chance * (1 - diffuse)
                delta |= up
                if self.passes:
                    down = perfect & ~up
                    chance = (1 - chance) * (1 - diffuse)
                    passed, name = -eye, F.Null
                    if not self.straight:
                        cos_t = fresnel(o.z, layers.eta)[1]
                        bent = dr.normalize(eye * -layers.eta + ns * (layers.eta * o.z - cos_t))
                        passed, name = self.fold(bent, ng, -1), F.DeltaTransmission
                    light[down] = passed
                    kind[down] = mi.UInt32(+name)
                    weight[down] = layers.passing(o.z) * dr.square(layers.eta) / chance
                    bs.pdf[down] = chance
                    bs.eta[down] = 1 / layers.eta
                    delta |= down
        f, pdf = self.value(layers, o, frame.to_local(light), dr.dot(light, ng))
        finite = (kind != 0) & ~delta
        bs.pdf[finite] = pdf
        weight[finite] = dr.select(pdf > 0, f / pdf, 0)
        bs.pdf *= layers.coverage
        weight *= self.through(si, front)
        if self.alpha_mode != "OPAQUE":
            light[~met] = -eye
            kind[~met] = mi.UInt32(+F.Null)
            weight[~met] = mi.Color3f(1)
            bs.pdf[~met] = 1 - layers.coverage
        bs.wo = si.to_local(light)
        bs.sampled_type = kind
        bs.sampled_component = mi.UInt32(0)
        good = active & (bs.pdf > 0) & dr.all(dr.isfinite(weight))
        bs.pdf = dr.select(good, bs.pdf, 0)
        return bs, dr.select(good, weight, 0)

    @staticmethod
    def fold(w, ng, side):
        """Where the shading normal sends a perfect ray to the wrong side of the triangle: mirrored in its plane."""
        below = dr.dot(w, ng)
        return dr.select(below * side > 0, w, w - 2 * below * ng)

    def to_string(self):
        return f"GltfBsdf[{self.name}]"
