"""Reads a picture of ours with OpenEXR's own library: python read_exr.py FILE

Fails unless the picture, its layers and their channels are there under the names we promise, every number is
finite, some light arrived, and the four layers of light sum to the picture.
"""

import sys

import numpy as np
import OpenEXR

LIGHT = ["direct", "indirect", "specular", "emission"]
COLOURS = LIGHT + ["albedo", "irradiance"]
VECTORS = ["normal", "position"]
WANTED = ["R", "G", "B", "A", "depth.Z", "variance.Y"]
WANTED += [f"{layer}.{c}" for layer in COLOURS for c in "RGB"]
WANTED += [f"{layer}.{c}" for layer in VECTORS for c in "XYZ"]


def main(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        header = set(file.header())  # the file takes its own along when it closes
        channels = {name: np.asarray(c.pixels, np.float64) for name, c in file.channels().items()}
    missing = [name for name in WANTED if name not in channels]
    assert not missing, f"missing channels {missing}; there are {sorted(channels)}"
    wild = [name for name, pixels in channels.items() if not np.isfinite(pixels).all()]
    assert not wild, f"not finite: {wild}"
    assert "chromaticities" in header, "no chromaticities in the header"

    luminance = 0.2126 * channels["R"] + 0.7152 * channels["G"] + 0.0722 * channels["B"]
    assert luminance.mean() > 0, "the picture is black"
    for c in "RGB":
        total = sum(channels[f"{layer}.{c}"] for layer in LIGHT)
        # Half floats round each of five numbers by up to 2^-11.
        worst = np.abs(total - channels[c]).max() / np.abs(channels[c]).max()
        assert worst < 2e-3, f"the layers of light miss the picture by {worst:.2g} of its brightest pixel"
    height, width = luminance.shape
    print(f"{path}: {width} x {height}, {len(channels)} channels, mean luminance {luminance.mean():.4g} cd/m2")


if __name__ == "__main__":
    main(*sys.argv[1:])
