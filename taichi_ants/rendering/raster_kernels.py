"""Kernels that draw cells and marks as pixels; they do not check their arguments.

A frame is uint8 (height, width, 3), colours are 0xRRGGBB. Outlines are signed distances, negative
inside. Their unit is the radius of the mark: each shape lies within the unit circle around (0, 0).
x points right and y down; an ant looks up, towards negative y.
"""

import math

import taichi as ti
from taichi.math import clamp, mix, vec2, vec3

from taichi_ants.rendering.colours import PAGE, Mark

BAND = 16  # rows of pixels per thread
_SQRT_3 = math.sqrt(3.0)
_HALO = 1.2  # pixels around an ant in the colour of the page
_CRUMB_AT = -0.70  # y of the food that an ant carries, in front of its head
_CRUMB_RADIUS = 0.25


@ti.func
def unpack(colour):
    """Return red, green and blue, 0 to 255."""
    word = ti.cast(colour, ti.i32)
    return vec3(word >> 16 & 255, word >> 8 & 255, word & 255)


@ti.func
def put(frame: ti.template(), y, x, rgb):
    for channel in ti.static(range(3)):
        frame[y, x, channel] = ti.cast(rgb[channel] + 0.5, ti.u8)


@ti.kernel
def draw_small_cells(
    frame: ti.types.ndarray(dtype=ti.u8, ndim=3),
    colours: ti.types.ndarray(dtype=ti.u32, ndim=1),
    x: ti.f32,
    y: ti.f32,
    hexagon: ti.f32,
    columns: ti.i32,
    rows: ti.i32,
    z_range: ti.i32,
):
    """Draw cells of a few pixels or less: each pixel is the mean of its cells, weighted by area.

    Cells are drawn as rectangles with the centres and areas of the hexagons, because the overlap of
    two rectangles is a simple product; at this size the difference is invisible. The origin
    `(x, y)` and the size `hexagon` are those of a `Rasteriser`; `columns`, `rows` and `z_range` are
    those of an `AxialGrid`.
    """
    ti.loop_config(block_dim=BAND)
    for j in range(frame.shape[0]):
        for i in range(frame.shape[1]):
            # In these units a rectangle is 1 wide and 1 high, in column r, and higher up with q.
            x0 = (i - x) / (1.5 * hexagon) + 0.5
            x1 = (i + 1 - x) / (1.5 * hexagon) + 0.5
            low = (y - (j + 1)) / (_SQRT_3 * hexagon) + 0.5
            high = (y - j) / (_SQRT_3 * hexagon) + 0.5
            rgb, weight = vec3(0.0), 0.0
            first = ti.max(ti.cast(ti.floor(x0), ti.i32), -z_range)
            for r in range(first, ti.min(ti.cast(ti.floor(x1), ti.i32) + 1, rows - z_range)):
                across = ti.min(x1, r + 1.0) - ti.max(x0, ti.cast(r, ti.f32))
                q0, q1 = low + 0.5 * r, high + 0.5 * r
                bottom = ti.max(ti.cast(ti.floor(q0), ti.i32), -z_range)
                for q in range(
                    bottom, ti.min(ti.cast(ti.floor(q1), ti.i32) + 1, columns - z_range)
                ):
                    area = across * (ti.min(q1, q + 1.0) - ti.max(q0, ti.cast(q, ti.f32)))
                    cell = (r + z_range) * columns + q + z_range
                    rgb += area * unpack(colours[cell])
                    weight += area
            rest = (x1 - x0) * (high - low) - weight
            rgb = (rgb + rest * unpack(PAGE)) / (weight + rest)
            put(frame, j, i, clamp(rgb, 0.0, 255.0))


@ti.func
def disc(p, x, y, radius):
    """Return the distance to a disc around (x, y)."""
    return (p - vec2(x, y)).norm() - radius


@ti.func
def ellipse(p, y, half_width, half_height):
    """Return the distance to an upright ellipse around (0, y), accurate near its outline."""
    inverse = vec2(1.0 / half_width, 1.0 / half_height)
    scaled = (p - vec2(0.0, y)) * inverse
    level = scaled.norm()
    steepness = (scaled * inverse).norm()
    return level * (level - 1.0) / ti.max(steepness, 1e-6)


@ti.func
def line(p, x0, y0, x1, y1):
    """Return the distance, not negative, to the line from (x0, y0) to (x1, y1)."""
    along = vec2(x1 - x0, y1 - y0)
    from_start = p - vec2(x0, y0)
    share = ti.math.clamp(from_start.dot(along) / along.dot(along), 0.0, 1.0)
    return (from_start - share * along).norm()


@ti.func
def hexagon(p):
    """Return the distance to a flat-topped hexagon with corners on the unit circle."""
    half_height = 0.8660254
    slanted = ti.abs(p.x) * half_height + ti.abs(p.y) * 0.5
    return ti.max(slanted, ti.abs(p.y)) - half_height


@ti.func
def ant_body(p):
    """Return the distance to the head, thorax and abdomen of an ant."""
    head = ellipse(p, -0.37, 0.19, 0.17)
    thorax = ellipse(p, -0.06, 0.13, 0.20)
    abdomen = ellipse(p, 0.45, 0.27, 0.39)
    return ti.min(head, ti.min(thorax, abdomen))


@ti.func
def ant_limbs(p):
    """Return the distance to six legs and two antennae, which are lines without width."""
    q = vec2(ti.abs(p.x), p.y)
    front = ti.min(line(q, 0.08, -0.16, 0.42, -0.34), line(q, 0.42, -0.34, 0.56, -0.66))
    middle = ti.min(line(q, 0.08, -0.06, 0.48, -0.02), line(q, 0.48, -0.02, 0.74, 0.20))
    hind = ti.min(line(q, 0.08, 0.04, 0.44, 0.26), line(q, 0.44, 0.26, 0.58, 0.70))
    antenna = ti.min(line(q, 0.07, -0.48, 0.17, -0.68), line(q, 0.17, -0.68, 0.30, -0.86))
    return ti.min(ti.min(front, middle), ti.min(hind, antenna))


@ti.func
def dart(p):
    """Return the distance to a dart, the shape of ants in small cells."""
    q = vec2(ti.abs(p.x), p.y)
    side = q.dot(vec2(0.932, -0.362)) - 0.326  # from the tip (0, -0.9) to (0.67, 0.824)
    back = q.dot(vec2(-0.336, 0.942)) - 0.551  # from there to the notch (0, 0.585)
    return ti.max(side, back)


@ti.func
def crumbs(p):
    """Return the distance to three crumbs, the shape of food."""
    q = vec2(ti.abs(p.x), p.y)
    return ti.min(disc(p, 0.0, -0.36, 0.36), disc(q, 0.40, 0.30, 0.36))


@ti.func
def crown(p):
    """Return the distance to the queen's crown, whose three points have a bead each."""
    q = vec2(ti.abs(p.x), p.y)
    # The right half, from the middle point (0, -0.5) down to (0.32, -0.02), up to (0.8, -0.28).
    top = ti.min(q.dot(vec2(0.832, -0.555)) - 0.277, q.dot(vec2(-0.476, -0.879)) + 0.135)
    side = q.dot(vec2(0.975, 0.222)) - 0.718
    beads = ti.min(disc(p, 0.0, -0.60, 0.12), disc(q, 0.84, -0.38, 0.12))
    return ti.min(ti.max(ti.max(top, side), p.y - 0.60), beads)


@ti.func
def arrow(p):
    """Return the distance to an arrow that points up."""
    q = vec2(ti.abs(p.x), p.y)
    head = ti.max(q.dot(vec2(0.857, -0.515)) - 0.489, p.y - 0.05)
    shaft = ti.max(q.x - 0.2, ti.abs(p.y - 0.45) - 0.5)
    return ti.min(head, shaft)


@ti.func
def blend(rgb, colour, distance, opacity):
    """Blend `colour` over `rgb` where `distance` (pixels) is negative, with a smooth edge."""
    return mix(rgb, unpack(colour), opacity * clamp(0.5 - distance, 0.0, 1.0))


@ti.func
def draw_mark(rgb, p, radius, shape, colour, load):
    """Return the colour of a pixel with a mark over it; `p` is relative to the upright mark.

    `load` is the colour of the food that an ant carries.
    """
    # Marks have a halo in the colour of the page; -1 disables it, also at smooth edges.
    distance, halo, opacity = radius * hexagon(p), -1.0, 1.0
    if shape == Mark.OUTLINE:
        half_width = ti.max(0.06 * radius, 0.8)
        distance, halo = ti.abs(distance + half_width) - half_width, 0.5 * _HALO
    elif shape == Mark.FOOD:
        distance, halo = radius * crumbs(p), 0.0
    elif shape == Mark.QUEEN:
        distance, halo = radius * crown(p), 0.0
    elif shape == Mark.ARROW:
        distance, halo = radius * arrow(p), _HALO
    elif shape == Mark.DOT:
        distance, halo = radius * disc(p, 0.0, 0.0, 1.0), 0.0
    elif shape >= Mark.ANT:
        limb = ti.max(0.032 * radius, 0.45)
        distance = radius * ti.min(ant_body(p), ant_limbs(p) - limb / radius)
        halo, opacity = _HALO, 0.8
    elif shape >= Mark.DART:
        distance, halo, opacity = radius * dart(p), _HALO, 0.8
    result = blend(blend(rgb, PAGE, distance - halo, opacity), colour, distance, 1.0)
    if shape == Mark.ANT_WITH_FOOD or shape == Mark.DART_WITH_FOOD:
        scale = ti.select(shape == Mark.DART_WITH_FOOD, 1.5, 1.0)
        crumb = radius * disc(p, 0.0, _CRUMB_AT, scale * _CRUMB_RADIUS)
        result = blend(blend(result, PAGE, crumb - _HALO, 1.0), load, crumb, 1.0)
    return result


@ti.kernel
def draw_marks(
    frame: ti.types.ndarray(dtype=ti.u8, ndim=3),
    table: ti.types.ndarray(dtype=ti.f32, ndim=2),
):
    """Draw marks over a frame, in the order of the table: later marks cover earlier ones.

    Columns of `table`: x, y (pixels), radius (pixels), heading, mark, opacity, colour, colour of
    carried food. Each thread draws whole bands of pixel rows, so the order does not depend on the
    number of threads.
    """
    ti.loop_config(block_dim=1)
    for band in range((frame.shape[0] + BAND - 1) // BAND):
        first, last = band * BAND, ti.min((band + 1) * BAND, frame.shape[0]) - 1
        for n in range(table.shape[0]):
            x, y, radius = table[n, 0], table[n, 1], table[n, 2]
            shape, colour = ti.cast(table[n, 4], ti.i32), ti.cast(table[n, 6], ti.i32)
            load = ti.cast(table[n, 7], ti.i32)
            reach = radius + ti.select(shape == Mark.DOT, 0.5, _HALO + 0.5)  # with its smooth edge
            if y + reach >= first and y - reach <= last + 1:
                angle = table[n, 3] * (math.pi / 3)
                cosine, sine = ti.cos(angle), ti.sin(angle)
                j0, j1 = ti.max(first, ti.cast(y - reach, ti.i32)), ti.cast(y + reach, ti.i32)
                i0, i1 = ti.max(0, ti.cast(x - reach, ti.i32)), ti.cast(x + reach, ti.i32)
                for j in range(j0, ti.min(j1, last) + 1):
                    for i in range(i0, ti.min(i1, frame.shape[1] - 1) + 1):
                        dx, dy = (i + 0.5 - x) / radius, (j + 0.5 - y) / radius
                        p = vec2(dx * cosine + dy * sine, dy * cosine - dx * sine)
                        rgb = vec3(frame[j, i, 0], frame[j, i, 1], frame[j, i, 2])
                        drawn = draw_mark(rgb, p, radius, shape, colour, load)
                        put(frame, j, i, mix(rgb, drawn, table[n, 5]))
