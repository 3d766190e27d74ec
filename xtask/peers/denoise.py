"""Open Image Denoise on numpy pictures, through the library that the `bpy` wheel brings along."""

import ctypes
import importlib.util
from pathlib import Path

import numpy as np

CPU = 1  # OIDNDeviceType
FLOAT3 = 3  # OIDNFormat


class Missing(Exception):
    """There is no library to be had."""


def library():
    """The library, loaded."""
    bpy = importlib.util.find_spec("bpy")  # found, not imported: Blender itself is not needed
    found = sorted(Path(bpy.origin).parent.glob("lib/libOpenImageDenoise.so.*")) if bpy else []
    if not found:
        raise Missing("no Open Image Denoise: pip install bpy")
    oidn = ctypes.CDLL(str(found[0]))
    pointer, size, text = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p
    oidn.oidnNewDevice.restype = pointer
    oidn.oidnSetDeviceInt.argtypes = [pointer, text, ctypes.c_int]
    oidn.oidnNewFilter.restype, oidn.oidnNewFilter.argtypes = pointer, [pointer, text]
    oidn.oidnSetSharedFilterImage.argtypes = [pointer, text, pointer, ctypes.c_int] + [size] * 5
    oidn.oidnSetFilterBool.argtypes = [pointer, text, ctypes.c_bool]
    oidn.oidnGetDeviceError.argtypes = [pointer, ctypes.POINTER(text)]
    for name in ("CommitDevice", "CommitFilter", "ExecuteFilter", "ReleaseFilter", "ReleaseDevice"):
        getattr(oidn, f"oidn{name}").argtypes = [pointer]
    return oidn


def denoise(color, albedo, normal, threads):
    """`color` (height, width, 3), linear and unbounded, freed of noise by the guides `albedo` and `normal`.

    The guides are freed of their own noise first, as the library's manual advises for the best result.
    """
    oidn = library()
    device = oidn.oidnNewDevice(CPU)
    oidn.oidnSetDeviceInt(device, b"numThreads", threads)
    oidn.oidnCommitDevice(device)

    def run(flags, **images):
        height, width = color.shape[:2]
        images = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}
        images["output"] = np.empty((height, width, 3), np.float32)
        rt = oidn.oidnNewFilter(device, b"RT")
        for name, image in images.items():
            at = image.ctypes.data_as(ctypes.c_void_p)
            oidn.oidnSetSharedFilterImage(rt, name.encode(), at, FLOAT3, width, height, 0, 0, 0)
        for flag in flags:
            oidn.oidnSetFilterBool(rt, flag, True)
        oidn.oidnCommitFilter(rt)
        oidn.oidnExecuteFilter(rt)
        message = ctypes.c_char_p()
        if oidn.oidnGetDeviceError(device, ctypes.byref(message)):
            raise RuntimeError(f"Open Image Denoise: {message.value.decode()}")
        oidn.oidnReleaseFilter(rt)
        return images["output"]

    albedo = run([], albedo=np.clip(albedo, 0, 1))
    normal = run([], normal=normal)
    result = run([b"hdr", b"cleanAux"], color=color, albedo=albedo, normal=normal)
    oidn.oidnReleaseDevice(device)
    return result
