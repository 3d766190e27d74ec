"""Renders a glTF scene with Mitsuba 3's path tracer, by the protocol in peer.py.

    python xtask/peers/render_mitsuba.py SCENE OUT.exr --size 384x256 --effort 64 [--camera NAME] [--denoise]

Uses the variant llvm_ad_rgb, which needs LLVM's library (Debian's libllvm19, or DRJIT_LIBLLVM_PATH).
Materials are glTF's, in a BSDF of our own (mitsuba_bsdf.py), and so are punctual lights (mitsuba_scene.py).
Where light may go straight on, through windows and alpha, Mitsuba's `volpath` takes the place of `path`: its
shadow rays pass there.
"""

import math
from pathlib import Path

import peer

try:
    import drjit as dr
    import mitsuba as mi
except ImportError:
    peer.missing(
        "Mitsuba is not installed: target/peers-venv/bin/pip install -r xtask/peers/requirements.txt"
    )
try:
    mi.set_variant("llvm_ad_rgb")
    dr.eval(mi.Float(0) + 1)
except Exception:
    peer.missing("Mitsuba finds no LLVM: apt install libllvm19, or set DRJIT_LIBLLVM_PATH")

import gltf  # noqa: E402
import numpy as np  # noqa: E402
from denoise import Missing, denoise  # noqa: E402
from mitsuba_scene import Builder  # noqa: E402: reads Mitsuba's variant

LANES = 1 << 23  # paths a pass: many, for they are stratified together; memory hardly grows with them


def passes(spp, most):
    """`spp` as a sum of counts of at most `most` that the multi-jittered sampler lays out as a rectangle."""
    while spp > 0:
        count = min(spp, most)
        while math.isqrt(count) * math.ceil(count / math.isqrt(count)) != count:
            count -= 1
        yield count
        spp -= count


def render(scene, spp, seed, pixels):
    """All layers of the film, mean of `spp` samples a pixel, (height, width, layers)."""
    total = 0.0
    for i, count in enumerate(passes(spp, max(LANES // pixels, 1))):
        picture = mi.render(scene, spp=count, seed=(seed * 0x10001 + i) % (1 << 32))
        total = total + count * np.array(picture, np.float64)
    return total / spp


def main():
    args = peer.arguments(__doc__, "samples a pixel")
    dr.set_thread_count(args.threads)
    report = peer.Report()
    try:
        with report.stage("load"):
            builder = Builder(gltf.load(args.scene), guides=args.denoise)
            scene = builder.build(args.camera, (args.width, args.height), depth=5)
    except gltf.Unsupported as reason:
        peer.beyond(str(reason))
    with report.stage("render"):
        layers = render(scene, args.effort, args.seed, args.width * args.height)
    picture = layers[..., :3]
    if args.denoise:
        try:
            with report.stage("denoise"):
                picture = denoise(picture, layers[..., 3:6], layers[..., 6:9], args.threads)
        except Missing as reason:
            peer.missing(str(reason))
    report.notes += builder.notes
    version, setting = f"Mitsuba {mi.__version__} {mi.variant()}", f"{args.effort} spp"
    what = f"{Path(args.scene).name}, {version}, {setting}{', denoised' if args.denoise else ''}, cd/m2"
    peer.write_exr(args.out, picture, what)
    report.end(version, setting)


if __name__ == "__main__":
    main()
