"""Fresnel terms, GGX and its directional albedo, for Mitsuba. Import after `mitsuba.set_variant`."""

import functools
import math

import drjit as dr
import mitsuba as mi
import numpy as np

ROWS, COLUMNS = 33, 65  # of the table of albedos, by √α and √cos


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
    """Directional albedo of GGX reflection by √α and √cos: the means of G2/G1 and of G2/G1 (1 − V·H)⁵.

    A flat array (rows · columns, 2), and for each row their averages over the cosine-weighted hemisphere.
    """
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
    # With μ = x², 2 ∫ E μ dμ = 4 ∫ E x³ dx; of the interpolated table, so that no energy is lost.
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
