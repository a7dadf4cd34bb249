"""Surfaces that Mitsuba lacks, as BSDFs of it: the formulae that marmor has too, written a second time over its own Fresnel functions and its own GGX distribution.

    rough_metal    GGX with height-correlated masking [Heitz 2014] and what is reflected more than once [KC17]; Mitsuba's
                   roughconductor has separable masking and one reflection alone
    rough_plastic  a coat of GGX with the same masking, over a body by shares that lose nothing [KSK01]
    oren_nayar     [PKH24], energy-preserving

Albedos are tables by quadrature over the model itself, not closed forms. For JIT variants alone.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

ENTRIES, SAMPLES = 256, 1 << 15


class Table:
    """A function of the cosine, at cosines ((i + 1/2) / ENTRIES)^2, and its mean weighted by the cosine."""

    def __init__(self, values):
        root = (np.arange(ENTRIES) + 0.5) / ENTRIES
        self.mean = float((4 * root**3 * values).sum() / (4 * root**3).sum())
        self.values = mi.Float(np.asarray(values, np.float32))

    def at(self, cosine):
        place = dr.clip(dr.sqrt(dr.maximum(cosine, 0)) * ENTRIES - 0.5, 0, ENTRIES - 1)
        i = dr.minimum(mi.UInt32(place), ENTRIES - 2)
        return dr.lerp(dr.gather(mi.Float, self.values, i), dr.gather(mi.Float, self.values, i + 1), place - i)


def cosines():
    return ((np.arange(ENTRIES) + 0.5) / ENTRIES) ** 2


class Facets:
    def __init__(self, alpha):
        self.ggx = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)

    def masking(self, a, b, m):
        """G of both directions, and of the first alone."""
        g = self.ggx.smith_g1(a, m)
        return dr.rcp(dr.rcp(g) + dr.rcp(self.ggx.smith_g1(b, m)) - 1), g

    def once(self, wi, wo):
        """f cos without the Fresnel factor, the density of wo, and the cosine at the facet."""
        m = dr.normalize(wi + wo)
        both, one = self.masking(wi, wo, m)
        scale = self.ggx.eval(m) / (4 * wi.z)
        return scale * both, scale * one, dr.dot(wi, m)

    def sample(self, wi, u):
        m, _ = self.ggx.sample(wi, u)
        return mi.reflect(wi, m)

    def albedo(self, fresnel):
        index = dr.arange(mi.UInt32, ENTRIES * SAMPLES)
        k, mu = index % SAMPLES, mi.Float(np.repeat(cosines(), SAMPLES).astype(np.float32))
        wi = mi.Vector3f(dr.safe_sqrt(1 - mu * mu), 0, mu)
        u = mi.Point2f((mi.Float(k) + 0.5) / SAMPLES, mi.Float(np.tile(np.mod(np.arange(SAMPLES) * 0.6180339887498949, 1), ENTRIES).astype(np.float32)))
        m, _ = self.ggx.sample(wi, u)
        wo = mi.reflect(wi, m)
        both, one = self.masking(wi, wo, m)
        value = dr.select(wo.z > 0, fresnel(dr.dot(wi, m)) * both / one, 0)
        return Table(np.array(value).reshape(ENTRIES, SAMPLES).mean(1))


def above(wi, wo):
    return (wi.z > 0) & (wo.z > 0)


class Mixed(mi.BSDF):
    """One lobe of facets, chosen with `chance`, and one by the cosine."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def both(self, wi, wo):
        value, density = mi.Color3f(self.even(wi, wo)), wo.z * dr.inv_pi
        if self.facets:
            once, pdf, cosine = self.facets.once(wi, wo)
            value, density = value + self.fresnel(cosine) * once, dr.lerp(density, pdf, self.chance)
        active = above(wi, wo)
        return value & active, dr.select(active, density, 0)

    def eval(self, ctx, si, wo, active):
        return self.both(si.wi, wo)[0] & active

    def pdf(self, ctx, si, wo, active):
        return dr.select(active, self.both(si.wi, wo)[1], 0)

    def eval_pdf(self, ctx, si, wo, active):
        value, density = self.both(si.wi, wo)
        return value & active, dr.select(active, density, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        if self.facets:
            wo = dr.select(sample1 < self.chance, self.facets.sample(si.wi, sample2), wo)
        value, density = self.both(si.wi, wo)
        active &= density > 0
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.pdf, bs.eta = wo, density, 1.0
        bs.sampled_type, bs.sampled_component = mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(0)
        return bs, (value / dr.select(active, density, 1)) & active

    def to_string(self):
        return type(self).__name__


class RoughMetal(Mixed):
    chance = 0.8

    def __init__(self, props):
        super().__init__(props)
        self.n, self.k, self.facets = list(props["n"]), list(props["k"]), Facets(props["alpha"])
        self.lost = self.facets.albedo(lambda mu: mi.Float(1))
        mu = mi.Float(((np.arange(4096) + 0.5) / 4096).astype(np.float32))
        mean = np.array(dr.mean(2 * mu * self.fresnel(mu), axis=1)).ravel()
        self.again = mi.Color3f([float(f * f * self.lost.mean / (1 - f * (1 - self.lost.mean))) for f in mean])

    def fresnel(self, mu):
        return mi.Color3f([mi.fresnel_conductor(mu, mi.Complex2f(float(n), float(k))) for n, k in zip(self.n, self.k)])

    def even(self, wi, wo):
        return self.again * ((1 - self.lost.at(wi.z)) * (1 - self.lost.at(wo.z)) / (1 - self.lost.mean) * dr.inv_pi * wo.z)


class RoughPlastic(Mixed):
    chance = 0.4

    def __init__(self, props):
        super().__init__(props)
        self.eta, self.body, self.facets = props["eta"], list(props["body"]), Facets(props["alpha"])
        self.coat = self.facets.albedo(self.fresnel)

    def fresnel(self, mu):
        return mi.fresnel(mu, self.eta)[0]

    def even(self, wi, wo):
        return mi.Color3f([float(a) for a in self.body]) * ((1 - self.coat.at(wi.z)) * (1 - self.coat.at(wo.z)) / (1 - self.coat.mean) * dr.inv_pi * wo.z)


class OrenNayar(Mixed):
    facets = None

    def __init__(self, props):
        super().__init__(props)
        self.body, self.roughness = [float(a) for a in props["body"]], float(props["roughness"])
        steps = 512
        mu, phi = (np.arange(steps) + 0.5) / steps, np.pi * (np.arange(steps) + 0.5) / steps
        mu, phi = np.meshgrid(mu**2, phi, indexing="ij")  # denser where it is steep
        weight = 2 * np.sqrt(mu) / steps * 2 * np.pi / steps * mu
        values = []
        for o in cosines():
            s = np.cos(phi) * np.sqrt((1 - mu * mu) * (1 - o * o))
            values.append((weight * self.once(mu, o, np.where(s > 0, s / np.maximum(mu, o), s))).sum())
        self.kept = Table(np.array(values))
        self.again = [float(a * a * self.kept.mean / (1 - a * (1 - self.kept.mean))) for a in self.body]

    def once(self, i, o, s):
        """f of white facets; s is that of the paper, over t where it is positive."""
        return (1 + self.roughness * s) / (np.pi * (1 + (0.5 - 2 / (3 * np.pi)) * self.roughness))

    def even(self, wi, wo):
        s = dr.dot(wi, wo) - wi.z * wo.z
        once = self.once(wi.z, wo.z, dr.select(s > 0, s / dr.maximum(wi.z, wo.z), s))
        more = (1 - self.kept.at(wi.z)) * (1 - self.kept.at(wo.z)) / (1 - self.kept.mean) * dr.inv_pi
        return (mi.Color3f(self.body) * once + mi.Color3f(self.again) * more) * wo.z


def register():
    for name, kind in (("rough_metal", RoughMetal), ("rough_plastic", RoughPlastic), ("oren_nayar", OrenNayar)):
        mi.register_bsdf(name, kind)
