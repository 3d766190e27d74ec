"""Renders the references of assets/reference with Mitsuba 3: two independent halves of each scene.

    python xtask/peers/make_references.py [NAME ...] --seconds 3600

samples the scenes named (all by default) in turns for about that long, then writes NAME.a.exr and NAME.b.exr.
Sums are kept in --scratch after every round: the command may be stopped at any time, and called again it goes
on from there. `--seconds 0` only converts what there is. Path tracing without a bound on length, clamping or
denoising.
"""

import argparse
import math
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from peer import write_exr

mi.set_variant("llvm_ad_rgb")

from gltf import load  # noqa: E402: these read Mitsuba's variant
from mitsuba_scene import Builder  # noqa: E402

ROOT = Path(__file__).parents[2]
# File, camera, size, and the share of time: the noisy ones get more.
SCENES = {
    "gallery": ("gallery.glb", "main", (384, 256), 8),
    "cornell-specular": ("cornell-specular.gltf", "camera", (256, 256), 8),
    "two-rooms": ("two-rooms.gltf", "camera", (256, 256), 3),
    "cornell-box": ("cornell-box.gltf", "camera", (256, 256), 3),
    "furnace-mixed": ("furnace-mixed.gltf", "camera", (256, 256), 1),
    "furnace": ("furnace.gltf", "camera", (256, 256), 1),
}
ROUND = 4.0  # seconds of a scene's turn for each unit of its share
PASS = 64  # samples a pixel; a square, so that they are stratified in both directions


def noise(a, b):
    """Error of the mean of two independent halves, a fraction, by the metric of `twolight compare`.

    Half their difference, relative to mean_c ref² + 0.01 M², M the mean luminance, the brightest tenth capped.
    """
    mean = 0.5 * (a + b)
    luminance = mean @ [0.2126, 0.7152, 0.0722]
    level = np.minimum(luminance, np.quantile(luminance, 0.9)).mean()
    if level == 0:
        return 0.0  # a room without light
    error = (0.25 * (a - b) ** 2).mean(-1) / ((mean**2).mean(-1) + 0.01 * level**2)
    return math.sqrt(error.mean())


class Reference:
    """The two halves of one scene: sums of radiance and passes made."""

    def __init__(self, name, scratch):
        file, self.camera, self.size, self.share = SCENES[name]
        self.name, self.path = name, ROOT / "assets" / file
        self.store = scratch / f"{name}.npz"
        self.scene = None
        self.sums, self.passes = np.zeros((2, self.size[1], self.size[0], 3)), [0, 0]
        if self.store.exists():
            stored = np.load(self.store)
            self.sums, self.passes = stored["sums"], stored["passes"].tolist()

    def sample(self, seconds):
        """Adds passes to both halves for so long, and stores them."""
        if self.scene is None:
            self.scene = Builder(load(self.path)).build(self.camera, self.size, depth=5)
        end = time.time() + seconds
        while True:
            for half in (0, 1):
                seed = 2 * self.passes[half] + half
                self.sums[half] += np.array(mi.render(self.scene, spp=PASS, seed=seed), np.float64)
                self.passes[half] += 1
            if time.time() > end:
                break
        unfinished = self.store.with_suffix(".new.npz")
        np.savez(unfinished, sums=self.sums, passes=self.passes)
        unfinished.replace(self.store)

    def halves(self):
        return [total / passes for total, passes in zip(self.sums, self.passes)]

    def write(self, folder):
        """Writes both pictures and says how noisy they are."""
        if not all(self.passes):
            return
        halves, spp = self.halves(), PASS * self.passes[0]
        for half, picture in zip("ab", halves):
            comments = f"{self.path.name}, Mitsuba {mi.__version__} path tracing, {spp} spp, cd/m2"
            write_exr(folder / f"{self.name}.{half}.exr", picture, comments, np.float16)
        print(f"{self.name}: 2 x {spp} spp, noise of the mean {100 * noise(*halves):.2f} %", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", default=list(SCENES), help=", ".join(SCENES))
    parser.add_argument("--seconds", type=float, default=3600, help="sample for about this long")
    parser.add_argument("--threads", type=int, default=0, help="all processors by default")
    parser.add_argument(
        "--scratch", type=Path, default=ROOT / "target" / "references", help="where sums are kept"
    )
    parser.add_argument("--out", type=Path, default=ROOT / "assets" / "reference")
    args = parser.parse_args()
    if args.threads:
        dr.set_thread_count(args.threads)
    args.scratch.mkdir(parents=True, exist_ok=True)
    references = [Reference(name, args.scratch) for name in args.names]
    end = time.time() + args.seconds
    while time.time() < end:
        for reference in references:
            reference.sample(min(ROUND * reference.share, max(end - time.time(), 0)))
    for reference in references:
        reference.write(args.out)


if __name__ == "__main__":
    main()
