"""Exact geodesic lengths on a triangle mesh (Mitchell, Mount & Papadimitriou 1987, as coded by pygeodesic).

    python -m venv ENVIRONMENT && ENVIRONMENT/bin/pip install pygeodesic==0.1.11 trimesh scipy numpy
    ENVIRONMENT/bin/python polyhedral.py MESH PAIRS > LENGTHS
    ENVIRONMENT/bin/python polyhedral.py MESH PAIRS --random 10 10 --seed 1 > LENGTHS

ENVIRONMENT is a new folder. MESH is OFF, OBJ or PLY (ascii or binary). PAIRS has two 0-based vertex indices of the file a line; one length a line
is printed in the same order and in the file's units, "inf" where no path along triangles joins the two.
--random S T first writes PAIRS: S sources with T targets each, all different, drawn from the vertices that the
triangles of the largest component use. Pairs that share a source cost one field together.
"""

import argparse
import sys
import time

import numpy as np
import trimesh
from pygeodesic import geodesic
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def read_mesh(path):
    """Vertices in the order of the file and the triangles; nothing merged, nothing dropped."""
    mesh = trimesh.load(path, force="mesh", process=False, maintain_order=True)
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int)


def components(vertex_count, faces):
    """Component number of each vertex; -1 for a vertex that no triangle uses."""
    a, b = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    graph = coo_matrix((np.ones(len(a)), (a, b)), (vertex_count, vertex_count))
    label = connected_components(graph, directed=False)[1]
    label[np.bincount(faces.ravel(), minlength=vertex_count) == 0] = -1
    return label


def random_pairs(label, sources, targets, seed):
    """Seeded pairs of different vertices of the largest component."""
    largest = np.bincount(label[label >= 0]).argmax()
    members = np.flatnonzero(label == largest)
    chosen = np.random.default_rng(seed).choice(members, sources * (targets + 1), replace=False)
    return [(s, t) for s, *ends in chosen.reshape(sources, targets + 1) for t in ends]


def lengths(vertices, faces, label, pairs):
    """Exact polyhedral distance of each pair."""
    result = np.full(len(pairs), np.inf)
    result[pairs[:, 0] == pairs[:, 1]] = 0.0
    joined = (label[pairs[:, 0]] == label[pairs[:, 1]]) & (label[pairs[:, 0]] >= 0) & (pairs[:, 0] != pairs[:, 1])
    for piece in np.unique(label[pairs[joined, 0]]):
        members = np.flatnonzero(label == piece)
        compact = np.full(len(vertices), -1)
        compact[members] = np.arange(len(members))
        solver = geodesic.PyGeodesicAlgorithmExact(vertices[members], compact[faces[label[faces[:, 0]] == piece]])
        rows = np.flatnonzero(joined & (label[pairs[:, 0]] == piece))
        for source in np.unique(pairs[rows, 0]):
            start = time.time()
            of_source = rows[pairs[rows, 0] == source]
            field = solver.geodesicDistances(np.array([compact[source]]), compact[pairs[of_source, 1]])[0]
            result[of_source] = field
            print(f"source {source}: {time.time() - start:.1f} s", file=sys.stderr, flush=True)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("pairs")
    parser.add_argument("--random", nargs=2, type=int, metavar=("S", "T"))
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    vertices, faces = read_mesh(options.mesh)
    label = components(len(vertices), faces)
    if options.random:
        np.savetxt(options.pairs, random_pairs(label, *options.random, options.seed), fmt="%d")
    pairs = np.loadtxt(options.pairs, dtype=int, ndmin=2)
    if pairs.shape[1] != 2 or pairs.min() < 0 or pairs.max() >= len(vertices):
        sys.exit(f"{options.pairs}: expected two indices from 0 to {len(vertices) - 1} a line")
    for length in lengths(vertices, faces, label, pairs):
        print(repr(float(length)))


if __name__ == "__main__":
    main()
