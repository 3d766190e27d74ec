"""Triangles, normals and tangents of glTF meshes, where the file leaves them to the reader. See gltf.py.

The functions that take a mesh change it in place, but for `face_normals` and `tangents`, which return.
"""

import numpy as np


def unit(v):
    """The vectors `v` (…, 3), each made of length 1; those of length 0 stay."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / np.where(length > 0, length, 1)


def triangle_list(mode, corners):
    """Lists, strips and fans as (m, 3); None for points and lines."""
    if mode == 4:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if mode == 5:
        t = np.arange(max(len(corners) - 2, 0))
        return corners[np.stack([t, t + 1 + t % 2, t + 2 - t % 2], axis=1)]
    if mode == 6:
        t = np.arange(max(len(corners) - 2, 0))
        return corners[np.stack([t + 1, t + 2, 0 * t], axis=1)]
    return None


def face_normals(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    return unit(np.cross(b - a, c - a))


def unshare(mesh, faces):
    """Gives the triangles of these numbers corners of their own."""
    corners = mesh.triangles[faces].reshape(-1)
    kept = np.arange(len(mesh.positions)) if len(faces) < len(mesh.triangles) else np.arange(0)
    pick = np.concatenate([kept, corners])
    for name in ("positions", "normals", "colors", "tangents"):
        if getattr(mesh, name) is not None:
            setattr(mesh, name, getattr(mesh, name)[pick])
    mesh.uvs = [None if uv is None else uv[pick] for uv in mesh.uvs]
    mesh.triangles = mesh.triangles.copy()
    mesh.triangles[faces] = len(kept) + np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)


def turn_to_front(mesh):
    """The winding says which side is the front: normals of triangles wound against them are turned round."""
    faces = face_normals(mesh)
    agree = np.einsum("tki,ti->t", mesh.normals[mesh.triangles].astype(np.float64), faces)
    against = np.flatnonzero(agree < 0)
    if len(against):
        unshare(mesh, against)
        mesh.normals[mesh.triangles[against]] *= -1
    missing = np.flatnonzero(~mesh.normals[mesh.triangles].any(axis=2).all(axis=1))
    if len(missing):
        unshare(mesh, missing)
        mesh.normals[mesh.triangles[missing]] = faces[missing, None]


def tangents(mesh, uv):
    """Tangents along growing u, averaged over the triangles of a vertex: near what MikkTSpace gives."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    ua, ub, uc = (uv[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    (du1, dv1), (du2, dv2) = (ub - ua).T, (uc - ua).T
    area = du1 * dv2 - du2 * dv1
    along = ((b - a) * dv2[:, None] - (c - a) * dv1[:, None]) * np.sign(area)[:, None]
    sums, sides = np.zeros_like(mesh.positions, np.float64), np.zeros(len(mesh.positions))
    for k in range(3):
        np.add.at(sums, mesh.triangles[:, k], along)
        np.add.at(sides, mesh.triangles[:, k], area)
    n = mesh.normals.astype(np.float64)
    flat = unit(sums - n * np.einsum("vi,vi->v", n, sums)[:, None])
    # v points down in glTF and the bitangent up: it is cross(n, t) where the image is seen mirrored.
    return np.hstack([flat, np.where(sides > 0, -1.0, 1.0)[:, None]]).astype(np.float32)
