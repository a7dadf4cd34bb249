"""Triangle meshes that both programs get: lists of corners and of faces, outside counter-clockwise."""

import math


def rectangle(centre, u, v):
    """Half edges u and v; its outside is where u x v points."""
    corner = lambda a, b: [centre[i] + a * u[i] + b * v[i] for i in range(3)]
    return [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], [[0, 1, 2], [0, 2, 3]]


def box(low, high, turn=0.0, inwards=False):
    """From corner to corner, turned about its upright axis by degrees."""
    points = [[(low, high)[(i >> a) & 1][a] for a in range(3)] for i in range(8)]
    mid, c, s = [(low[a] + high[a]) / 2 for a in range(3)], math.cos(math.radians(turn)), math.sin(math.radians(turn))
    points = [[mid[0] + c * (x - mid[0]) + s * (z - mid[2]), y, mid[2] - s * (x - mid[0]) + c * (z - mid[2])]
              for x, y, z in points]
    quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    faces = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return points, [f[::-1] for f in faces] if inwards else faces


def ball(centre, radius, rings=12, segments=20):
    points = [[0.0, 1.0, 0.0]]
    for i in range(1, rings):
        t = math.pi * i / rings
        points += [[math.sin(t) * math.sin(p), math.cos(t), math.sin(t) * math.cos(p)]
                   for p in (2 * math.pi * k / segments for k in range(segments))]
    points.append([0.0, -1.0, 0.0])
    at = lambda i, k: 0 if i == 0 else len(points) - 1 if i == rings else 1 + (i - 1) * segments + k % segments
    faces = []
    for i in range(rings):
        for k in range(segments):
            if i > 0:
                faces.append([at(i, k), at(i + 1, k), at(i, k + 1)])
            if i < rings - 1:
                faces.append([at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)])
    return [[centre[a] + radius * p[a] for a in range(3)] for p in points], faces


def ball_uv(rings=12, segments=20):
    """Texture coordinates of the corners of `ball`: to the right and upwards; its last strip has the whole picture mirrored and squeezed."""
    return [[0.5, 1.0]] + [[k / segments, 1 - i / rings] for i in range(1, rings) for k in range(segments)] + [[0.5, 0.0]]


def torus(centre, large, small, n=24, m=12):
    """About an axis that leans towards the camera."""
    points, c, s = [], math.cos(0.9), math.sin(0.9)
    for i in range(n):
        for k in range(m):
            a, b = 2 * math.pi * i / n, 2 * math.pi * k / m
            x, y, z = (large + small * math.cos(b)) * math.sin(a), small * math.sin(b), (large + small * math.cos(b)) * math.cos(a)
            points.append([centre[0] + x, centre[1] + c * y - s * z, centre[2] + s * y + c * z])
    at = lambda i, k: (i % n) * m + k % m
    faces = []
    for i in range(n):
        for k in range(m):
            faces += [[at(i, k), at(i + 1, k), at(i + 1, k + 1)], [at(i, k), at(i + 1, k + 1), at(i, k + 1)]]
    return points, faces


def volume(points, faces):
    """Signed: positive if outside is counter-clockwise."""
    total = 0.0
    for a, b, c in ([points[i] for i in f] for f in faces):
        total += sum(a[i] * (b[(i + 1) % 3] * c[(i + 2) % 3] - b[(i + 2) % 3] * c[(i + 1) % 3]) for i in range(3))
    return total / 6
