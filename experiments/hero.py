"""Make the film at the top of the README: ants learn from nothing, and find a way round a wall.

The command runs 100 colonies of 64 ants, each with its own seed. It measures when lanes form and
how long the ants then search for a way round a wall. It films the colony whose two times are
closest to the median, and writes `hero_dark.webp` and `hero_light.webp`. This takes about two
minutes of processor time.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import io
    import math
    from collections import namedtuple
    from collections.abc import Iterator
    from dataclasses import dataclass, field
    from itertools import pairwise
    from pathlib import Path

    import numpy as np
    from PIL import Image
    from scipy.ndimage import gaussian_filter
    from scipy.spatial import cKDTree

    from taichi_ants import Colony, Interventions, TrainingConfig, World, files, task
    from taichi_ants.grid.hexgrid import AxialGrid, centre_of, cube
    from taichi_ants.interventions import Place
    from taichi_ants.records import Snapshot
    from taichi_ants.rendering import text
    from taichi_ants.rendering.colours import Mark, channels
    from taichi_ants.rendering.rasteriser import draw_marks, marks
    from taichi_ants.studies.command_line import Parser, run_command
    from taichi_ants.task.constants import FOOD, OBSTACLE, Event

ROOT = Path(__file__).parents[1]
# The dots of an ant, (x, y, radius) in sizes of a hexagon: it looks along y.
_LEGS = [
    (side * (0.12 + 0.62 * out), y + turn * out, 0.075)
    for side in (-1, 1)
    for y, turn in ((0.12, 0.42), (0.0, 0.0), (-0.1, -0.5))
    for out in (0.2, 0.4, 0.6, 0.8, 1.0)
]
BODY = (
    *_LEGS,
    *((0, -0.78, 0.34), (0, -0.56, 0.37), (0, -0.2, 0.18), (0, 0.05, 0.21), (0, 0.48, 0.29)),
)
RADIUS = 34  # of the grid, a hexagon of cells that is larger than the picture
_REACH = range(1 - RADIUS, RADIUS)
CELLS = cube([(q, r) for q in _REACH for r in _REACH if abs(q - r) < RADIUS])
SEEDS, ANTS = 100, 64
SIZE, BAND, HEXAGON = (960, 600), 92, 11.0  # pixels: the picture, the text above the world, a cell
CENTRES = centre_of(CELLS, HEXAGON)
ROUND, FADE, QUALITY = 14, 0.4, 54  # radius of corners, seconds, of 100
FPS, DRAWN_AT = 20, 2  # frames per second; pictures are drawn twice as large, for smooth edges

# Lanes: 25 deliveries in 100 ticks. The wall starts 60 ticks later. Detour: ten loads that were
# picked up after the wall was complete have been delivered.
LANES, WINDOW, PAUSE, DETOUR = 25, 100, 60, 10
AFTER = 180  # ticks shown after the detour
LONGEST = 1500  # ticks after which a colony counts as one that found no detour

# Relative to the middle: axial coordinates (q, r), and circles (x, y, radius) in pixels.
QUEEN, PILE = (-17, -17), (281, -162, 62)
ROCKS = (
    *((-340, -150, 62), (-285, -172, 48), (-300, -112, 38), (-40, -262, 80), (40, -275, 62)),
    *((405, 75, 58), (446, 40, 44), (372, 112, 36), (60, 252, 72), (125, 262, 56)),
    *((330, 275, 56), (-432, -8, 34), (205, 128, 30), (228, 146, 24)),
)
WALL = ((2.5, -2.5), (-2.5, 2.5))  # the ends of the stroke, which crosses the straight way
LEVEL = 600  # of a fresh trail
STROKE = 24  # ticks in which it is drawn


# The colours of one theme.
Look = namedtuple("Look", "page floor trail rock rim wall ant food nest ink faint")
LOOKS = {
    "dark": Look(
        *(0x0D1117, 0x18232D, 0x2FA9BC, 0x46545F, 0x8296A3, 0xD7DEE2),
        *(0xF6ECDA, 0xFFB938, 0xF5708F, 0xF0F3F1, 0x9FB0B9),
    ),
    "light": Look(
        *(0xFFFFFF, 0xFBF4E6, 0x2A979D, 0xBFB29A, 0x83765E, 0x54432F),
        *(0x2A2018, 0xDD4A0C, 0x8E24AA, 0x221C15, 0x6A5F52),
    ),
}


def within(*circles: tuple[float, float, float]) -> np.ndarray:
    """Return which of `CELLS`, some far outside the picture, have their centres in a circle."""
    away = [(np.hypot(*(CENTRES - (x, y)).T), radius) for x, y, radius in circles]
    return np.any([distance <= radius for distance, radius in away], axis=0)


def meadow() -> World:
    """Return a world as wide as the picture, with one nest, one pile of food and some rocks."""
    half = np.array([SIZE[0], SIZE[1] - BAND]) / 2 - HEXAGON
    outside = (np.abs(CENTRES) > half).any(axis=1)
    foods = within(PILE) & ~outside
    rocks = (within(*ROCKS) | outside) & ~foods
    return World((RADIUS,) * 3, cube(QUEEN), CELLS[foods], CELLS[rocks])


def colony_of(seeds: list[int]) -> Colony:
    """Return colonies that have learned nothing, one for each seed, under the rules for queues."""
    rules = task.queueing().replace(
        life={"regrowth": 0},
        delivery="terminates",
        pheromone={"level": LEVEL, "slope": LEVEL // 50},
        evaporation_in_training=True,
    )
    config = TrainingConfig(
        *("q_learning", 0.1, 0.9, 0.03, 1.0), min_epsilon=0.0, initial_q=5.0
    )  # learning rate, discount, exploration rate
    colony = Colony(meadow(), rules, config, seeds, ants=ANTS)
    colony.begin_episode()
    return colony


def stroke() -> list[list[list[int]]]:
    """Return the cells of the wall, three cells thick, by the tick in which each is drawn."""
    seen, parts = np.zeros(len(CELLS), bool), []
    for place in np.linspace(*WALL, STROKE):
        middle = centre_of(cube(place.round()), HEXAGON)
        new = within((*middle, 1.9 * HEXAGON)) & ~seen
        seen |= new
        parts.append(CELLS[new].tolist())
    return parts


@dataclass
class Course:
    """The measured times of one colony each, in ticks; -1 for what has not happened."""

    first: np.ndarray  # the first delivery
    lanes: np.ndarray
    detour: np.ndarray  # when it was found
    deliveries: list[np.ndarray] = field(default_factory=list)  # up to each tick
    snapshots: list[Snapshot] = field(default_factory=list)  # of the first colony, if they are kept

    @property
    def wall(self) -> np.ndarray:
        """The tick in which the stroke begins."""
        return np.where(self.lanes < 0, LONGEST, self.lanes + PAUSE)

    @property
    def search(self) -> np.ndarray:
        """Ticks from the complete wall to the detour."""
        return self.detour - self.wall - STROKE


def run(seeds: list[int], after: int = 0, keep: bool = False) -> Course:
    """Return the course of colonies until all have found a detour, and of `after` more ticks.

    With `keep`, it has a snapshot of the first colony before each tick, and of the end.
    """
    colony, parts, n = colony_of(seeds), stroke(), len(seeds)
    course = Course(*(np.full(n, -1) for _ in range(3)), [np.zeros(n, int)])
    picked, came = np.full((n, ANTS), LONGEST), np.zeros(n, int)
    while len(course.deliveries) <= min(LONGEST, course.detour.max() + after) or (
        course.detour.min() < 0 and len(course.deliveries) <= LONGEST
    ):
        tick = len(course.deliveries)
        if keep:
            course.snapshots.append(colony.snapshot())
        drawn = tick - 1 - course.wall
        for world in np.flatnonzero((drawn >= 0) & (drawn < STROKE)).tolist():
            if cells := parts[drawn[world]]:
                Interventions(colony, [world]).apply(Place("rock", cells))
        colony.tick()
        picked[colony.events == Event.PICKED_UP] = tick
        delivers = colony.events == Event.DELIVERED
        course.deliveries.append(course.deliveries[-1] + delivers.sum(axis=1))
        lately = course.deliveries[-1] - course.deliveries[max(0, tick - WINDOW)]
        came += (delivers & (picked > (course.wall + STROKE)[:, None])).sum(axis=1)
        times = course.first, course.lanes, course.detour
        for when, happened in zip(
            times, (lately > 0, lately >= LANES, came >= DETOUR), strict=True
        ):
            when[(when < 0) & happened] = tick
    if keep:
        course.snapshots.append(colony.snapshot())
    return course


def most_typical(course: Course) -> int:
    """Return the colony whose times of lanes and of the search are closest to the median."""
    ranks = [np.argsort(np.argsort(one, kind="stable")) for one in (course.lanes, course.search)]
    away = np.abs(np.array(ranks) - (len(course.lanes) - 1) / 2).max(axis=0)
    return int(away.argmin())


class Painter:
    """Draws snapshots of the meadow in the colours of a theme."""

    def __init__(self, look: Look, grid: AxialGrid) -> None:
        self.look, self.grid = look, grid
        width, height = SIZE[0], SIZE[1] - BAND
        x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
        _, nearest = cKDTree(CENTRES).query(np.stack([x, y], axis=-1))
        self.cell = grid.index(CELLS)[nearest]  # of each pixel
        corner = np.array([width, height])[:, None, None] / 2 - ROUND - np.abs(np.stack([x, y]))
        self.panel = np.clip(ROUND + 0.5 - np.hypot(*np.minimum(corner, 0)), 0, 1)[..., None]
        self.rocks = grid.index(CELLS[within(*ROCKS)])
        self.start: np.ndarray | None = None  # the ground at the start
        self.rock: tuple[bytes, np.ndarray] = (b"", np.zeros(0))  # of a ground, and its picture

    def draw(self, snapshots: list[Snapshot], share: float) -> np.ndarray:
        """Return the world between the last two snapshots; earlier ones leave pale traces."""
        look, now = self.look, snapshots[-1]
        floor = channels(np.array([self.look.floor, self.look.trail])) * 1.0
        level = (now.trail / LEVEL)[self.cell]
        level = sum(gaussian_filter(level, wide * HEXAGON) for wide in (0.9, 2.0)) / 2
        picture = floor[0] + (floor[1] - floor[0]) * level[..., None] ** 0.85
        rock, light, wall = self.rock_of(now.ground)
        stone = channels(look.rock) + light * (channels(look.rim) - 1.0 * channels(look.rock))
        picture += rock * (stone - picture)
        picture += wall * (channels(look.wall) - picture)
        frame = np.rint(picture).astype(np.uint8).repeat(DRAWN_AT, 0).repeat(DRAWN_AT, 1)
        draw_marks(frame, *self.marks(snapshots, share))
        height, width = self.cell.shape
        small = frame.reshape(height, DRAWN_AT, width, DRAWN_AT, 3).mean(axis=(1, 3))
        return channels(look.page) + self.panel * (small - channels(look.page))

    def rock_of(self, ground: np.ndarray) -> np.ndarray:
        """Return the shares of rock, of the light on it, and of the wall in each pixel."""
        if ground.tobytes() != self.rock[0]:
            self.start = ground if self.start is None else self.start
            rock = np.isin(np.arange(self.grid.size), self.rocks)
            wall = (ground == OBSTACLE) & (self.start != OBSTACLE)
            soft, of_wall = (
                gaussian_filter(one[self.cell] * 1.0, 0.95 * HEXAGON, mode="nearest")
                for one in (rock, wall)
            )
            light = np.clip(4 * (soft - np.roll(soft, (3, 2), (0, 1))), 0, 1)  # from top left
            light[:3] = light[:, :2] = 0  # which `roll` takes from the other side
            shares = [np.clip(15 * (one - 0.42), 0, 1) for one in (soft, of_wall)]
            self.rock = ground.tobytes(), np.stack([shares[0], light, shares[1]])
        return self.rock[1][..., None]

    def marks(self, snapshots: list[Snapshot], share: float) -> list[np.ndarray]:
        """Return the marks of food, the nest and ants, for a picture drawn large."""
        look, size, (before, now) = self.look, DRAWN_AT * HEXAGON, snapshots[-2:]
        foods = self.places(np.flatnonzero(now.ground == FOOD))
        tables = [marks(foods, 0.72 * size, Mark.DOT, look.food)]
        for radius, colour in ((1.9, look.nest), (1.5, look.floor), (0.9, look.nest)):
            tables.append(marks(self.places(now.queens), radius * size, Mark.DOT, colour))
        for past, later in pairwise(snapshots[:-1]):
            old, new = self.places(past.ant_cells), self.places(later.ant_cells)
            streak = np.concatenate([old + part * (new - old) for part in (0, 1 / 3, 2 / 3)])
            tables.append(marks(streak, 0.22 * size, Mark.DOT, look.ant, opacity=0.16))
        turn = (now.ant_headings - before.ant_headings + 3) % 6 - 3
        angle = (before.ant_headings + share * turn) * (math.pi / 3)
        ahead = np.stack([np.sin(angle), -np.cos(angle)], axis=-1) * size
        aside = np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
        old, new = self.places(before.ant_cells), self.places(now.ant_cells)
        at = old + share * (new - old)
        for x, y, radius in BODY:
            tables.append(marks(at + y * ahead + x * aside, radius * size, Mark.DOT, look.ant))
        loads = (at + 1.0 * ahead)[now.ant_carries]
        tables.append(marks(loads, 0.42 * size, Mark.DOT, look.food))
        return tables

    def places(self, cells: np.ndarray) -> np.ndarray:
        """Return the centres of cells in the large picture."""
        height, width = self.cell.shape
        middle = np.array([width, height]) * DRAWN_AT / 2
        return centre_of(self.grid.cells(cells), DRAWN_AT * HEXAGON) + middle


def film(course: Course, look: Look) -> Iterator[np.ndarray]:
    """Yield the pictures of a colony, uint8 (height, width, 3)."""
    first, lanes, wall, detour = (
        int(one[0]) for one in (course.first, course.lanes, course.wall, course.detour)
    )
    end = len(course.snapshots) - 1
    captions = (
        (0, f"{ANTS} ants that know nothing"),
        (first, f"tick {first}: the first delivery"),
        (lanes, f"tick {lanes}: lanes"),
        (wall, "a wall across the lanes"),
        (wall + STROKE, "who finds a way round?"),
        (detour, f"a detour, found in {course.search[0]} ticks"),
    )
    seconds = 0.0, 1.6, 2.5, 3.1, 4.0, 4.8, 6.2, 7.2, 8.0
    ticks = 0, 30, first, lanes, wall, wall + STROKE, detour, end - 20, end
    painter, opening = Painter(look, course.snapshots[0].grid), None
    for number in range(round(FPS * seconds[-1])):
        times = [np.interp(max(0, number - n) / FPS, seconds, ticks) for n in (0, 1)]
        now, before = (min(math.ceil(one), end) for one in times)
        now = max(now, 1)
        # Traces of all ticks since the last picture.
        shown = course.snapshots[max(0, min(now - 1, before)) : now + 1]
        world = painter.draw(shown, times[0] - now + 1)
        frame = np.full((SIZE[1], SIZE[0], 3), channels(look.page))
        frame[BAND:] = np.rint(world)
        caption = [words for tick, words in captions if tick <= now][-1]
        text.write(frame, caption, 2, 54, 46, look.ink)
        if now > 30:  # before, ants stand there
            text.write(frame, "nest", 200, 552, 28, look.nest, align="middle")
        home = str(course.deliveries[now][0])
        text.write(frame, home, SIZE[0] - 2, 54, 46, look.food, align="right")
        text.write(
            frame, "food", SIZE[0] - 16 - text.width(home, 46), 54, 30, look.faint, align="right"
        )
        opening = frame if opening is None else opening
        fade = np.clip((number / FPS - seconds[-1] + FADE) / FADE, 0, 1)  # the film repeats
        yield np.rint(frame + fade * (opening - 1.0 * frame)).astype(np.uint8)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add, renders = parser.add_argument, ROOT / "renders"
    add("--folder", type=Path, default=renders, help="write both films here")
    add("--seeds", type=int, default=SEEDS, help="choose among so many colonies")
    return parser.parse_args(arguments)


def make_hero(settings: argparse.Namespace) -> None:
    """Choose the typical colony, and film it in both themes."""
    all_courses = run(list(range(settings.seeds)))
    seed = most_typical(all_courses)
    course = run([seed], AFTER, keep=True)
    for name, of in (("first delivery", "first"), ("lanes", "lanes"), ("search", "search")):
        low, middle, high = np.percentile(getattr(all_courses, of), [0, 50, 100])
        here = getattr(course, of)[0]
        print(f"{name}: median {middle:g} ticks ({low:g} to {high:g}); seed {seed}: {here}")
    for theme, look in LOOKS.items():
        path = settings.folder / f"hero_{theme}.webp"
        first, *others = (Image.fromarray(frame) for frame in film(course, look))
        content = io.BytesIO()
        options = {"save_all": True, "append_images": others, "duration": 1000 // FPS, "loop": 0}
        first.save(content, "WEBP", **options, quality=QUALITY, method=4)
        files.write_bytes(path, content.getvalue())
        print(f"{path}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    run_command(lambda: make_hero(parse_arguments()))
