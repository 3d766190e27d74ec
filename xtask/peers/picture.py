"""Pictures of the peers: EXR files, and the noise between two halves."""

import math

import numpy as np
import OpenEXR

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def write_exr(path, pixels, comments, dtype=np.float32):
    """`pixels` (height, width, 3), linear Rec. 709 in cd/m², first row on top, as an EXR of `dtype`."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "comments": comments}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels, dtype)}).write(str(path))


def noise(a, b):
    """Error of the mean of two independent halves, a fraction, by the metric of `twolight compare`: half their
    difference, relative to mean_c ref² + 0.01 M², M the mean luminance with the brightest tenth capped."""
    mean = 0.5 * (a + b)
    luminance = mean @ LUMINANCE
    level = np.minimum(luminance, np.quantile(luminance, 0.9)).mean()
    if level == 0:
        return 0.0  # a room without light
    error = (0.25 * (a - b) ** 2).mean(-1) / ((mean**2).mean(-1) + 0.01 * level**2)
    return math.sqrt(error.mean())
