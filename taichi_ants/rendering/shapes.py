"""Outlines of what is drawn on cells, as signed distances: negative inside, in units of the shape.

Coordinates are x to the right and y downwards, with (0, 0) in the middle and the shape within the
unit circle; an ant looks up, towards negative y.
"""

import taichi as ti
from taichi.math import vec2

CRUMB_AT = -0.70  # where an ant carries food, before its head
CRUMB_RADIUS = 0.25


@ti.func
def disc(p, x, y, radius):
    """A disc around (x, y)."""
    return (p - vec2(x, y)).norm() - radius


@ti.func
def ellipse(p, y, half_width, half_height):
    """An upright ellipse around (0, y); close to the true distance near its outline."""
    inverse = vec2(1.0 / half_width, 1.0 / half_height)
    scaled = (p - vec2(0.0, y)) * inverse
    level = scaled.norm()
    steepness = (scaled * inverse).norm()
    return level * (level - 1.0) / ti.max(steepness, 1e-6)


@ti.func
def line(p, x0, y0, x1, y1):
    """The distance to a line from (x0, y0) to (x1, y1), not negative."""
    along = vec2(x1 - x0, y1 - y0)
    from_start = p - vec2(x0, y0)
    share = ti.math.clamp(from_start.dot(along) / along.dot(along), 0.0, 1.0)
    return (from_start - share * along).norm()


@ti.func
def hexagon(p):
    """A flat-topped hexagon with corners on the unit circle."""
    half_height = 0.8660254
    slanted = ti.abs(p.x) * half_height + ti.abs(p.y) * 0.5
    return ti.max(slanted, ti.abs(p.y)) - half_height


@ti.func
def ant_body(p):
    """Head, thorax and abdomen."""
    head = ellipse(p, -0.37, 0.19, 0.17)
    thorax = ellipse(p, -0.06, 0.13, 0.20)
    abdomen = ellipse(p, 0.45, 0.27, 0.39)
    return ti.min(head, ti.min(thorax, abdomen))


@ti.func
def ant_limbs(p):
    """Six legs and two antennae, as lines without width."""
    q = vec2(ti.abs(p.x), p.y)
    front = ti.min(line(q, 0.08, -0.16, 0.42, -0.34), line(q, 0.42, -0.34, 0.56, -0.66))
    middle = ti.min(line(q, 0.08, -0.06, 0.48, -0.02), line(q, 0.48, -0.02, 0.74, 0.20))
    hind = ti.min(line(q, 0.08, 0.04, 0.44, 0.26), line(q, 0.44, 0.26, 0.58, 0.70))
    antenna = ti.min(line(q, 0.07, -0.48, 0.17, -0.68), line(q, 0.17, -0.68, 0.30, -0.86))
    return ti.min(ti.min(front, middle), ti.min(hind, antenna))


@ti.func
def dart(p):
    """A pointed shape for ants of few pixels."""
    q = vec2(ti.abs(p.x), p.y)
    side = q.dot(vec2(0.932, -0.362)) - 0.326  # from the tip (0, -0.9) to (0.67, 0.824)
    back = q.dot(vec2(-0.336, 0.942)) - 0.551  # from there to the notch (0, 0.585)
    return ti.max(side, back)


@ti.func
def crumbs(p):
    """Food: three crumbs."""
    q = vec2(ti.abs(p.x), p.y)
    return ti.min(disc(p, 0.0, -0.36, 0.36), disc(q, 0.40, 0.30, 0.36))


@ti.func
def crown(p):
    """The queen: a crown with three points, each with a bead."""
    q = vec2(ti.abs(p.x), p.y)
    # Half of it, from the middle point (0, -0.5) down to (0.32, -0.02) and up to (0.8, -0.28).
    top = ti.min(q.dot(vec2(0.832, -0.555)) - 0.277, q.dot(vec2(-0.476, -0.879)) + 0.135)
    side = q.dot(vec2(0.975, 0.222)) - 0.718
    beads = ti.min(disc(p, 0.0, -0.60, 0.12), disc(q, 0.84, -0.38, 0.12))
    return ti.min(ti.max(ti.max(top, side), p.y - 0.60), beads)


@ti.func
def arrow(p):
    """An arrow that points up."""
    q = vec2(ti.abs(p.x), p.y)
    head = ti.max(q.dot(vec2(0.857, -0.515)) - 0.489, p.y - 0.05)
    shaft = ti.max(q.x - 0.2, ti.abs(p.y - 0.45) - 0.5)
    return ti.min(head, shaft)
