"""How strong the lobes of a glTF material are: metal, coat, diffuse base, transmission. See mitsuba_bsdf.py.

Import after `mitsuba.set_variant`.
"""

import math

import drjit as dr
import mitsuba as mi
from mitsuba_microfacets import fresnel, schlick

SMOOTH_ROUGHNESS = 0.03  # below it mirror and glass are perfect
WIDE = 0.03  # a lobe that loses more between its facets gives it to the diffuse light
FAINT = 0.1  # facets that reflect less than this are not worth counting twice


class Layers:
    """The material of `bsdf` at the surface interactions `si`, textures and vertex colours applied."""

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
        self.kept = bsdf.albedo.mean(self.alpha, mi.Float(1), active)
        self.of_metal, self.of_coat = self._regained(color), self._regained(self.f0)
        self.is_wide = (self.alpha > 0) & (1 - self.kept > WIDE)
        facets = self.of_metal * metallic + self.of_coat * (self.coat * specular)
        self.facets = dr.select(self.is_wide, facets, 0)
        if bsdf.has_coat:
            mean = bsdf.albedo.mean(self.alpha, self.f0_most, active)
            mean += dr.max(self.of_coat) * (1 - self.kept)
            self.mean_passed = 1 - specular * mean
            self.base = dr.select(self.mean_passed > 1e-4, self.base, 0)

    def _regained(self, f0):
        """Of the light that meets a second facet, the share that gets out at last (Kulla and Conty 2017)."""
        f = f0 + (1 - f0) / 21
        share = dr.square(f) * self.kept / (1 - f * (1 - self.kept))
        return dr.select((self.alpha > 0) & (dr.max(f0) >= FAINT), share, 0)

    def _all(self, cos):
        return self.bsdf.albedo.directional(self.alpha, cos, mi.Float(1), self.active)

    def lost(self, cos):
        """1 − E of facets that reflect everything."""
        return dr.maximum(1 - self._all(cos), 0)

    def regained(self, cos, cos_o, cos_i):
        """What `reflection` gains by light that bounces between facets, where these are narrow."""
        total = schlick(self.color, cos) * self.of_metal * self.metal
        total += schlick(self.f0, cos) * self.of_coat * (self.coat * self.specular)
        e = dr.maximum(self._all(cos_o) * self._all(cos_i), 0.25)
        return dr.select(self.is_wide, 0, total * (1 / dr.sqrt(e) - 1))

    def diffuse_share(self, cos):
        """Share of uniform light that leaves diffusely toward `cos`."""
        return self.base * self.passed(cos) + self.facets * self.lost(cos)

    def passed(self, cos):
        """1 − E: what gets past the coat."""
        if not self.bsdf.has_coat:
            return mi.Float(1)
        e = self.bsdf.albedo.directional(self.alpha, cos, self.f0_most, self.active)
        e += dr.max(self.of_coat) * (1 - self._all(cos))
        return dr.maximum(1 - self.specular * e, 0)

    def diffuse(self, cos_o, cos_i):
        """f of the base, 1/sr."""
        f = self.base / math.pi
        if self.bsdf.has_coat:
            f = f * (self.passed(cos_o) * self.passed(cos_i) / self.mean_passed)
        lost = self.lost(cos_o) * self.lost(cos_i) / dr.maximum(1 - self.kept, 1e-5)
        return f + self.facets * (lost / math.pi)

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
