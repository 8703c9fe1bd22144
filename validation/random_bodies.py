"""Random bodies for `random_scenes.py`: triangulated blocks, wedges, discs, arches, slit blocks,
and bodies cut from a grid of cells (corners, holes, pinches).

A body is a `Triangulation` whose curves are its sides. Nodes and triangles are numbered at random, so that no
result can depend on their order.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import shared  # noqa: F401
from elements import Pieces, counter_clockwise
from lagrange import SIDES, Lagrange
from outline import Outline
from triangulation import Triangulation, edge_keys


def grid(rng, nx, ny, point):
    """nx × ny cells of two triangles, mapped by point(s, t) from the unit square; a cell's diagonal
    is drawn. Returns (points, node[i, j], triangles)."""
    node = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    s, t = np.meshgrid(np.arange(nx + 1) / nx, np.arange(ny + 1) / ny, indexing="ij")
    # Inner nodes are moved a little: no two triangles need be alike.
    shift = 0.2 * rng.uniform(-1, 1, (2, nx + 1, ny + 1))
    shift[:, [0, -1]] = shift[:, :, [0, -1]] = 0.0
    points = np.stack(point(s + shift[0] / nx, t + shift[1] / ny), -1).reshape(-1, 2)
    triangles = []
    for i in range(nx):
        for j in range(ny):
            a, b, c, d = node[i, j], node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]
            triangles += [(a, b, c), (a, c, d)] if rng.random() < 0.5 else [(a, b, d), (b, c, d)]
    return points, node, np.array(triangles)


def chain(nodes):
    """Edges along a list of nodes."""
    return np.stack((nodes[:-1], nodes[1:]), 1)


def sides(node):
    """The four sides of a grid."""
    return {"south": chain(node[:, 0]), "east": chain(node[-1]), "north": chain(node[:, -1]), "west": chain(node[0])}


def block(rng, n=None):
    """A rectangle, sheared or with a curved foot; sides south, east, north, west."""
    aspect = 10 ** rng.uniform(-0.8, 0.8)
    nx = int(rng.integers(4, 14)) if n is None else n
    ny = int(np.clip(round(nx / aspect), 2, 20))
    shear = rng.choice([0, rng.uniform(-0.5, 0.5)])
    bulge = rng.choice([0, rng.uniform(-0.15, 0.15)])

    def point(s, t):
        y = t / aspect + bulge * 4 * s * (1 - s) * (1 - t)
        return s + shear * y, y

    points, node, triangles = grid(rng, nx, ny, point)
    return points, triangles, sides(node)


def wedge(rng):
    """A triangle with its tip at the origin, from 1e-3 to 60 degrees; sides lower, end, upper."""
    half = 0.5 * np.radians(rng.choice([10 ** rng.uniform(-3, 0), rng.uniform(1, 60)]))
    nr, na = int(rng.integers(5, 20)), int(rng.integers(1, 6))
    points, node, triangles = grid(
        rng, nr, na, lambda s, t: (s * np.cos(half * (2 * t - 1)), s * np.sin(half * (2 * t - 1))))
    tip = node[0, 0]
    triangles = np.where(np.isin(triangles, node[0]), tip, triangles)
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    lines = sides(node)
    lower, upper = (np.where(np.isin(lines[k], node[0]), tip, lines[k]) for k in ("south", "north"))
    return points, triangles, {"lower": lower, "end": lines["east"], "upper": upper}


def disc(rng):
    """A disc, its rim in three arcs (south, east, west, of which south is centred below)."""
    n, rings = int(rng.integers(15, 48)), int(rng.integers(2, 7))
    start = -0.5 * np.pi - rng.uniform(0.3, 1.2)
    turn = lambda s: start + 2 * np.pi * s
    points, node, triangles = grid(rng, n, rings, lambda s, t: (t * np.cos(turn(s)), t * np.sin(turn(s))))
    triangles = np.where(np.isin(triangles, node[:, 0]), node[0, 0], triangles)
    for j in range(rings + 1):
        triangles[triangles == node[-1, j]] = node[0, j]
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    rim = np.r_[node[:-1, -1], node[0, -1]]
    cut = max(2, round(n * 2 * (-0.5 * np.pi - start) / (2 * np.pi)))
    middle = int(rng.integers(cut + 1, n))
    parts = {"south": rim[:cut + 1], "east": rim[cut:middle + 1], "west": rim[middle:]}
    return points, triangles, {name: chain(part) for name, part in parts.items()}


def arch(rng):
    """A half ring standing on two feet: sides inner, right, outer, left."""
    inner, span = rng.uniform(0.3, 0.8), rng.uniform(0.5, 1.0) * np.pi
    n, m = int(rng.integers(10, 30)), int(rng.integers(2, 6))
    first = 0.5 * (np.pi - span)

    def point(s, t):
        r, a = inner + (1 - inner) * t, first + span * (1 - s)
        return r * np.cos(a), r * np.sin(a)

    points, node, triangles = grid(rng, n, m, point)
    lines = sides(node)
    return points, triangles, {"inner": lines["south"], "right": lines["east"],
                               "outer": lines["north"], "left": lines["west"]}


def slit(rng):
    """A block with a cut from the west side or inside. The nodes of the cut are doubled, except its tips. It has the sides
    of a block, and lips lower and upper."""
    nx, ny = int(rng.integers(5, 14)), 2 * int(rng.integers(2, 6))
    height = 10 ** rng.uniform(-0.5, 0.3)
    points, node, triangles = grid(rng, nx, ny, lambda s, t: (s, height * (t - 0.5)))
    points[node[:, ny // 2], 1] = 0.0
    last = int(rng.integers(3, nx))
    first = 0 if rng.random() < 0.6 else int(rng.integers(1, last - 1))
    inner = node[first if first == 0 else first + 1:last, ny // 2]
    twin = np.arange(len(points))
    twin[inner] = len(points) + np.arange(len(inner))
    points = np.vstack([points, points[inner]])
    above = points[triangles, 1].mean(1) > 0
    triangles[above] = twin[triangles[above]]
    lines = sides(node)
    cut = chain(node[first:last + 1, ny // 2])
    lines["lip_low"], lines["lip_high"] = cut, twin[cut]
    west = lines["west"]
    above = points[west, 1].mean(1) > 0
    west[above] = twin[west[above]]
    return points, triangles, lines


def largest_part(triangles):
    """The largest set of triangles that are connected through edges: one body."""
    sides = np.sort(np.vstack([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), 1)
    owner = np.tile(np.arange(len(triangles)), 3)
    _, edge = np.unique(sides, axis=0, return_inverse=True)
    order = np.argsort(edge.ravel(), kind="stable")
    same = np.diff(edge.ravel()[order]) == 0
    i, j = owner[order][:-1][same], owner[order][1:][same]
    graph = coo_matrix((np.ones(len(i)), (i, j)), (len(triangles), len(triangles)))
    _, part = connected_components(graph, directed=False)
    return triangles[part == np.bincount(part).argmax()]


def cells(rng):
    """Cells of a grid, some left out: re-entrant corners, holes, and corners that meet in a
    common node. Its sides are named by the directions they face, and split by chance."""
    shape = rng.integers(2, 5, 2)
    keep = rng.random(shape) < 0.75
    keep[tuple(rng.integers(0, shape))] = True
    r = int(rng.integers(2, 5))
    nx, ny = shape * r
    tilt = rng.choice([0, rng.uniform(-0.4, 0.4)])
    points, _, triangles = grid(rng, nx, ny, lambda s, t: (s * shape[0] + tilt * t, t * shape[1]))
    cell = np.stack(np.divmod(np.arange(nx * ny), ny), 1) // r
    triangles = largest_part(triangles[np.repeat(keep[cell[:, 0], cell[:, 1]], 2)])
    edges = Pieces(triangles).boundary()
    d = points[edges[:, 1]] - points[edges[:, 0]]
    facing = np.round(2 / np.pi * np.arctan2(-d[:, 0], d[:, 1])).astype(int) % 4
    split = points[edges].mean(1) @ rng.uniform(-1, 1, 2) > rng.uniform(-1, 1)
    lines = {}
    for k, name in enumerate(("east", "north", "west", "south")):
        lines[name] = edges[(facing == k) & split]
        lines[f"{name}2"] = edges[(facing == k) & ~split]
    return points, triangles, {name: part for name, part in lines.items() if len(part)}


def finish(rng, body, length, turn):
    """The body in its own size, turned, without unused nodes, numbered at random."""
    points, triangles, lines = body
    used = np.unique(triangles)
    number = np.full(len(points), -1)
    number[used] = rng.permutation(len(used))
    c, s = np.cos(turn), np.sin(turn)
    nodes = np.empty((len(used), 2))
    nodes[number[used]] = length * points[used] @ np.array([[c, s], [-s, c]])
    triangles = counter_clockwise(nodes, number[triangles][rng.permutation(len(triangles))])
    return Triangulation(nodes, triangles, {name: number[edges] for name, edges in lines.items()})


def bent(rng, mesh):
    """The body with second-order sides: their midpoints stay, or move across the side by up to a twentieth of the least
    height of their triangles. Larger moves may fold triangles."""
    t, x = mesh.triangles, mesh.nodes
    ends = x[t[:, SIDES]]
    chord = ends[:, :, 1] - ends[:, :, 0]
    twice_area = chord[:, 0, 0] * -chord[:, 2, 1] + chord[:, 0, 1] * chord[:, 2, 0]
    length = np.linalg.norm(chord, axis=2)
    keys = edge_keys(t[:, SIDES].reshape(-1, 2), len(x))
    _, edge = np.unique(keys, return_inverse=True)
    height = np.full(edge.max() + 1, np.inf)
    np.minimum.at(height, edge.ravel(), np.repeat(twice_area / length.max(axis=1), 3))
    height *= rng.choice([0.0, 0.01, 0.05]) * rng.uniform(-1, 1, len(height))
    # Both triangles of an edge must move its midpoint to the same place.
    forward = np.where(t[:, SIDES][:, :, 0] < t[:, SIDES][:, :, 1], 1.0, -1.0)
    across = np.stack([chord[..., 1], -chord[..., 0]], -1) / length[..., None]
    move = (forward * height[edge.reshape(-1, 3)])[..., None] * across
    return replace(mesh, middles=ends.mean(axis=2) + move)


def patched(rng, mesh):
    """The body with one or two surfaces: the triangles on one side of a line, in a disc, or random ones, which may touch
    each other in a node only."""
    centre, size = mesh.nodes[mesh.triangles].mean(axis=1), np.ptp(mesh.nodes, axis=0).max()
    surfaces, taken = {}, np.zeros(len(centre), bool)
    for name in ("core", "skin")[:int(rng.integers(1, 3))]:
        middle, way = centre[rng.integers(len(centre))], rng.integers(3)
        if way == 0:
            inside = (centre - middle) @ rng.standard_normal(2) > 0.0
        elif way == 1:
            inside = np.hypot(*(centre - middle).T) < rng.uniform(0.05, 0.5) * size
        else:
            inside = rng.random(len(centre)) < rng.uniform(0.1, 0.6)
        inside &= ~taken
        if inside.any() and not inside.all():
            surfaces[name] = inside
            taken |= inside
    return replace(mesh, surfaces=surfaces)


def with_points(rng, mesh):
    """The body with points of its geometry: sharp corners and some other nodes of its boundary."""
    outline = Outline(mesh)
    is_sharp = lambda node, ends: len(ends) != 2 or not outline.turns_little(node, ends)
    points = (node for node, ends in sorted(outline.ends.items()) if is_sharp(node, ends) or rng.random() < 0.2)
    return replace(mesh, points=frozenset(points))


def write_msh(mesh, path):
    """MSH 4.1, text: numbers as Python prints them, which reads back exactly. Each physical group is an entity."""
    space = Lagrange(mesh, 1 if mesh.middles is None else 2)
    line, triangle = (1, 2) if mesh.middles is None else (8, 9)
    # Surface 1 is the rest of the body.
    surface = np.ones(len(mesh.triangles), int)
    for k, inside in enumerate(mesh.surfaces.values(), 2):
        surface[inside] = k
    elements = np.asarray(space.elements)
    groups = [(1, k, line, space.on(edges)) for k, edges in enumerate(mesh.curves.values(), 1)]
    groups += [(2, k, triangle, elements[surface == k]) for k in np.unique(surface).tolist()]
    names = [f'1 {k} "{name}"' for k, name in enumerate(mesh.curves, 1)]
    names += ['2 1 "body"', *(f'2 {k} "{name}"' for k, name in enumerate(mesh.surfaces, 2))]
    count = len(space.points)
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names)), *names,
             "$EndPhysicalNames", "$Entities"]
    # Blocks of nodes (dimension, entity, first node, node after the last one): each point is one.
    points = sorted(mesh.points)
    begins = [0, *(node + 1 for node in points)]
    blocks = [(0, k, node, node + 1) for k, node in enumerate(points, 1)]
    blocks += [(2, groups[-1][1], a, b) for a, b in zip(begins, [*points, count]) if a < b]
    blocks.sort(key=lambda block: block[2])
    coordinates = [f"{x!r} {y!r} 0" for x, y in space.points.tolist()]
    lines += [f"{len(points)} {len(mesh.curves)} {len(groups) - len(mesh.curves)} 0"]
    lines += [f"{k} {coordinates[node]} 0" for k, node in enumerate(points, 1)]
    lines += [f"{k} 0 0 0 0 0 0 1 {k} 0" for _, k, _, _ in groups]
    lines += ["$EndEntities", "$Nodes", f"{len(blocks)} {count} 1 {count}"]
    for dimension, entity, a, b in blocks:
        lines += [f"{dimension} {entity} 0 {b - a}", *(str(node + 1) for node in range(a, b)), *coordinates[a:b]]
    total = sum(len(nodes) for _, _, _, nodes in groups)
    lines += ["$EndNodes", "$Elements", f"{len(groups)} {total} 1 {total}"]
    tag = 0
    for dimension, k, kind, rows in groups:
        lines.append(f"{dimension} {k} {kind} {len(rows)}")
        for nodes in rows:
            tag += 1
            lines.append(" ".join(map(str, [tag, *(int(node) + 1 for node in nodes)])))
    path.write_text("\n".join([*lines, "$EndElements", ""]), encoding="utf-8")
