"""Renders a glTF scene with Mitsuba 3's path tracer: one picture, box filter, linear Rec. 709 in cd/m².

    python xtask/peers/render_mitsuba.py SCENE OUT.exr --size 384x256 --effort 64 [--camera NAME] [--denoise]

Uses the variant llvm_ad_rgb, which needs LLVM's library (Debian's libllvm19, or DRJIT_LIBLLVM_PATH). The last line on
stdout is JSON: version, setting, seconds of each stage, and notes on what is modelled otherwise than glTF says.

Materials are glTF's, in a BSDF of our own (mitsuba_bsdf.py), and so are punctual lights (mitsuba_scene.py). Where
light may go straight on, through windows and alpha, Mitsuba's `volpath` takes the place of `path`: its shadow rays
pass such surfaces.
"""

import argparse
import json
import math
import os
import sys
import time

LANES = 1 << 21  # paths a pass, for memory: about half a kilobyte each


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--size", required=True, help="WIDTHxHEIGHT")
    parser.add_argument("--camera", help="name or number; the file's first by default")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--effort", type=int, default=64, help="samples a pixel")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--denoise", action="store_true", help="by Open Image Denoise, with albedo and normals"
    )
    args = parser.parse_args()
    args.size = tuple(map(int, args.size.split("x")))
    return args


def leave(code, text):
    """Ends with one line on stderr: 3, not installed; 4, beyond us."""
    print(text, file=sys.stderr)
    sys.exit(code)


try:
    import drjit as dr
    import mitsuba as mi
    import numpy as np
    from denoise import Missing, denoise
    from gltf import Unsupported, load
    from picture import write_exr
except ImportError as error:
    leave(3, f"{error}: pip install -r xtask/peers/requirements.txt")
try:
    mi.set_variant("llvm_ad_rgb")
    dr.eval(mi.Float(0) + 1)
except Exception:
    leave(3, "no LLVM for Mitsuba: apt install libllvm19, or set DRJIT_LIBLLVM_PATH")
from mitsuba_scene import Builder  # noqa: E402: reads Mitsuba's variant


def passes(spp, most):
    """`spp` as a sum of counts of at most `most` that the multi-jittered sampler lays out as a rectangle."""
    while spp > 0:
        count = min(spp, most)
        while math.isqrt(count) * math.ceil(count / math.isqrt(count)) != count:
            count -= 1
        yield count
        spp -= count


def render(scene, spp, seed, size):
    """All layers of the film, mean of `spp` samples a pixel, (height, width, layers)."""
    total = 0.0
    for i, count in enumerate(passes(spp, max(LANES // (size[0] * size[1]), 1))):
        picture = mi.render(scene, spp=count, seed=(seed * 0x10001 + i) % (1 << 32))
        total = total + count * np.array(picture, np.float64)
    return total / spp


def main():
    args = parse()
    dr.set_thread_count(args.threads)
    clock = [time.perf_counter()]
    builder = Builder(load(args.scene), guides=args.denoise)
    scene = builder.build(args.camera, args.size, depth=5)
    clock.append(time.perf_counter())
    layers = render(scene, args.effort, args.seed, args.size)
    clock.append(time.perf_counter())
    picture = layers[..., :3]
    if args.denoise:
        picture = denoise(picture, layers[..., 3:6], layers[..., 6:9], args.threads)
    clock.append(time.perf_counter())
    version, setting = f"Mitsuba {mi.__version__} {mi.variant()}", f"{args.effort} spp"
    write_exr(args.out, picture, f"{version}, {setting}{', denoised' if args.denoise else ''}, cd/m2")
    seconds = [round(b - a, 3) for a, b in zip(clock, clock[1:])]
    stages = dict(zip(("load", "render", "denoise"), seconds))
    print(json.dumps({"version": version, "setting": setting, "stages": stages, "notes": builder.notes}))


if __name__ == "__main__":
    try:
        main()
    except Unsupported as error:
        leave(4, str(error))
    except Missing as error:
        leave(3, str(error))
