"""Builds living_room.blend beside this file: a furnished room lit by sun and sky through a window and by one lamp.

The room spans x 0 to 5.2, y 0 to 4.2 and z 0 to 2.6; the window is in the east wall (x = 5.2), the sofa stands at the
north wall (y = 4.2). Furniture is set a fraction of a millimetre apart, so that no two faces ever coincide.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import bpy
import numpy as np
from modelling import (
    Colour,
    Shape,
    add_camera,
    add_mesh,
    box,
    diffuse,
    hanging_cloth,
    join,
    lathe,
    lattice,
    new_scene,
    point_lamp,
    polygons,
    prism,
    rounded_box,
    save,
    sheet,
    show,
    sphere,
    sun_lamp,
    tube,
)
from numpy.random import RandomState

Material = bpy.types.Material

WIDTH, DEPTH, HEIGHT = 5.2, 4.2, 2.6
WALL = 0.3
#: The window's hole in the east wall: from and to in y, then in z.
WINDOW_Y = (0.95, 3.15)
WINDOW_Z = (0.7, 2.25)
#: What keeps two solids apart that seem to touch.
GAP = 0.0005

PALETTE: dict[str, Colour] = {
    "Plaster": (0.74, 0.70, 0.64),
    "Teal plaster": (0.16, 0.34, 0.36),
    "Ceiling": (0.80, 0.79, 0.77),
    "White paint": (0.78, 0.77, 0.74),
    "Facade": (0.50, 0.46, 0.42),
    "Oak": (0.42, 0.24, 0.115),
    "Light oak": (0.52, 0.33, 0.175),
    "Honey oak": (0.46, 0.27, 0.13),
    "Dark oak": (0.37, 0.205, 0.098),
    "Grey oak": (0.45, 0.29, 0.16),
    "Walnut": (0.20, 0.10, 0.05),
    "Ochre cloth": (0.66, 0.36, 0.085),
    "Terracotta cloth": (0.58, 0.17, 0.09),
    "Cream cloth": (0.58, 0.51, 0.40),
    "Teal cloth": (0.09, 0.28, 0.32),
    "Rose cloth": (0.64, 0.34, 0.29),
    "Sage cloth": (0.34, 0.42, 0.27),
    "Linen": (0.78, 0.74, 0.66),
    "Lamp shade": (0.80, 0.70, 0.52),
    "Brass": (0.50, 0.33, 0.12),
    "Terracotta": (0.52, 0.20, 0.10),
    "Soil": (0.06, 0.04, 0.03),
    "Leaf": (0.09, 0.26, 0.065),
    "Young leaf": (0.19, 0.38, 0.09),
    "Orange": (0.80, 0.27, 0.03),
    "Glaze": (0.70, 0.72, 0.70),
    "Blue glaze": (0.10, 0.22, 0.42),
    "Paper": (0.76, 0.70, 0.58),
    "Evening sky": (0.78, 0.50, 0.30),
    "Evening sun": (0.80, 0.24, 0.08),
    "Far hill": (0.42, 0.32, 0.36),
    "Near hill": (0.13, 0.20, 0.26),
}

BOOK_COLOURS: list[Colour] = [
    (0.55, 0.08, 0.06),
    (0.70, 0.26, 0.06),
    (0.72, 0.50, 0.12),
    (0.22, 0.36, 0.14),
    (0.06, 0.22, 0.20),
    (0.08, 0.20, 0.42),
    (0.16, 0.10, 0.26),
    (0.48, 0.16, 0.26),
    (0.70, 0.64, 0.52),
    (0.10, 0.10, 0.11),
    (0.36, 0.20, 0.11),
    (0.24, 0.42, 0.46),
]


def build() -> None:
    scene = new_scene(world_colour=(0.52, 0.72, 1.0), world_strength=4.5)
    scene.render.resolution_x, scene.render.resolution_y = 1200, 800
    show(scene, "Standard", exposure=0.2)
    paint = {name: diffuse(name, colour) for name, colour in PALETTE.items()}
    books = [diffuse(f"Book {k + 1}", colour) for k, colour in enumerate(BOOK_COLOURS)]
    floor_boards = [paint[name] for name in ("Oak", "Light oak", "Honey oak", "Dark oak", "Grey oak")]

    receivers = [
        add_mesh("Room", room(paint)),
        add_mesh("Floor", boards(floor_boards)),
        add_mesh("Skirting", skirting(paint["White paint"])),
        add_mesh("Window frame", window_frame(paint["White paint"]), at=(WIDTH + 0.14, 0.0, 0.0)),
        add_mesh("Window sill", window_sill(paint["White paint"])),
        add_mesh("Curtains", curtains(paint["Linen"], paint["Brass"])),
        add_mesh("Rug", rug(paint), at=(2.9, 2.35, GAP)),
        add_mesh("Sofa", sofa(3, paint["Ochre cloth"], paint["Walnut"]), at=(3.05, 3.66, GAP)),
        add_mesh("Sofa pillows", pillows(paint), at=(3.05, 3.66, GAP)),
        add_mesh("Armchair", sofa(1, paint["Sage cloth"], paint["Walnut"]), at=(4.42, 1.15, GAP), turn=-118.0),
        add_mesh("Pouf", pouf(paint["Terracotta cloth"]), at=(1.87, 2.0, 0.012)),
        add_mesh("Low table", low_table(paint["Walnut"]), at=(2.95, 2.4, 0.012)),
        add_mesh("Table things", table_things(paint, books), at=(2.95, 2.4, 0.412)),
        add_mesh("Bookshelf", bookshelf(paint["Light oak"]), at=(0.98, 4.02, GAP)),
        add_mesh("Books", shelved_books(books, paint), at=(0.98, 4.02, GAP)),
        add_mesh("Floor lamp", floor_lamp(paint), at=(4.72, 3.68, GAP)),
        add_mesh("Plant", plant(paint), at=(4.62, 2.62, GAP)),
        add_mesh("Picture", picture(paint), at=(3.05, DEPTH - GAP, 1.62)),
    ]
    add_mesh("Facade", facade(paint["Facade"]))

    sun_lamp("Sun", 12.0, (1.0, 0.84, 0.64), at=(8.0, 2.35, 3.3), target=(2.6, 2.05, 0.0), angle=1.5)
    point_lamp("Lamp", 34.0, (1.0, 0.70, 0.40), at=(4.72, 3.68, 1.5), radius=0.04)
    add_camera(at=(0.34, 0.28, 1.42), target=(3.06, 3.3, 0.98), focal_length=20.5)
    save(Path(__file__).with_name("living_room.blend"), receivers)


# The house


def _corners(margin: float) -> np.ndarray:
    """The eight corners of the room grown by a margin: the four below, then the four above, counter-clockwise."""
    low, high = -margin, np.array([WIDTH, DEPTH, HEIGHT]) + margin
    ground = [(low, low), (high[0], low), (high[0], high[1]), (low, high[1])]
    return np.array([(x, y, z) for z in (low, high[2]) for x, y in ground])


def _hole(x: float) -> np.ndarray:
    """The window's four corners in the plane of a given x, counter-clockwise seen from inside."""
    (south, north), (low, high) = WINDOW_Y, WINDOW_Z
    return np.array([(x, north, low), (x, south, low), (x, south, high), (x, north, high)])


def room(paint: dict[str, Material]) -> Shape:
    """Walls, ceiling and the window's reveal, seen from inside. The floor is an object of its own, the facade closes
    the wall outside; around the window it meets the reveal."""
    corners = _corners(0.0)
    vertices = np.concatenate([corners, _hole(WIDTH), _hole(WIDTH + WALL)])
    south, north, west, ceiling = (1, 0, 4, 5), (3, 2, 6, 7), (0, 3, 7, 4), (7, 6, 5, 4)
    east = [(2, 1, 9, 8), (1, 5, 10, 9), (5, 6, 11, 10), (6, 2, 8, 11)]
    reveal = [(8 + k, 8 + (k + 1) % 4, 12 + (k + 1) % 4, 12 + k) for k in range(4)]
    plaster = paint["Plaster"]
    return polygons(
        vertices,
        [south, north, west, ceiling, *east, *reveal],
        [plaster, paint["Teal plaster"], plaster, paint["Ceiling"], *[plaster] * 8],
    )


def facade(material: Material) -> Shape:
    """The outside of the house: keeps the sky out of the walls. Only the window opens it."""
    vertices = np.concatenate([_corners(WALL), _hole(WIDTH + WALL)])
    whole = [(0, 1, 5, 4), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7), (3, 2, 1, 0)]
    east = [(8, 9, 1, 2), (9, 10, 5, 1), (10, 11, 6, 5), (11, 8, 2, 6)]
    return polygons(vertices, whole + east, material)


def boards(woods: list[Material]) -> Shape:
    """Floor boards along x: rows of boards of four cells each, every row shifted and coloured by chance."""
    choose = RandomState(7)
    columns, rows, length = 16, 30, 4
    x_cuts, y_cuts = np.linspace(0.0, WIDTH, columns + 1), np.linspace(0.0, DEPTH, rows + 1)
    vertices = [(x, y, 0.0) for x in x_cuts for y in y_cuts]
    faces, materials = [], []
    for j in range(rows):
        shift = choose.randint(4)
        wood = {board: woods[choose.randint(len(woods))] for board in range(columns // length + 2)}
        for i in range(columns):
            corner = i * (rows + 1) + j
            faces.append((corner, corner + rows + 1, corner + rows + 2, corner + 1))
            materials.append(wood[(i + shift) // length])
    return polygons(vertices, faces, materials)


def skirting(material: Material) -> Shape:
    """A board around the foot of the walls, mitred in the corners."""
    thickness, height = 0.016, 0.09
    profile = [(GAP, GAP), (thickness, GAP), (thickness, height), (GAP, height)]
    corners = [(0.0, 0.0), (WIDTH, 0.0), (WIDTH, DEPTH), (0.0, DEPTH)]
    inward = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    vertices = [
        (x + u * offset, y + v * offset, z)
        for (x, y), (u, v) in zip(corners, inward, strict=True)
        for offset, z in profile
    ]
    n = len(profile)
    faces = [
        (i * n + j, i * n + (j + 1) % n, (i + 1) % 4 * n + (j + 1) % n, (i + 1) % 4 * n + j)
        for i in range(4)
        for j in range(n)
    ]
    return polygons(vertices, faces, material).facing_outward()


def window_frame(material: Material) -> Shape:
    """Frame, two mullions and a transom: one slab with six panes cut out, standing in the reveal."""
    (south, north), (low, high) = WINDOW_Y, WINDOW_Z
    bar = 0.055
    third = (north - south) / 3.0
    x_cuts = [south + GAP, south + bar]
    for k in (1, 2):
        x_cuts += [south + k * third - bar / 2.0, south + k * third + bar / 2.0]
    x_cuts += [north - bar, north - GAP]
    transom = high - 0.45
    y_cuts = [low + GAP, low + bar, transom, transom + bar, high - bar, high - GAP]
    frame = lattice(x_cuts, y_cuts, 0.06, lambda i, j: None if i % 2 and j % 2 else material)
    return frame.turned(90.0, "X").turned(90.0, "Z")


def window_sill(material: Material) -> Shape:
    """A board on the lower reveal that reaches into the room."""
    (south, north), low = WINDOW_Y, WINDOW_Z[0]
    reach, end = -0.07, 0.13
    sill = rounded_box((end - reach, north - south - 2.0 * GAP, 0.03), 0.01, material, steps=2, flat=1)
    return sill.moved(WIDTH + (reach + end) / 2.0, (south + north) / 2.0, low + GAP)


def curtains(cloth: Material, metal: Material) -> Shape:
    """Two gathered curtains on a rod with round ends."""
    x, top = WIDTH - 0.15, 2.44
    south, north = WINDOW_Y[0] - 0.42, WINDOW_Y[1] + 0.42
    rod = tube(np.array([(x, south, top), (x, north, top)]), 0.012, metal)
    ends = [sphere(0.024, metal, 16).moved(x, y, top - 0.024) for y in (south - 0.025, north + 0.025)]
    brackets = [
        box((0.135, 0.014, 0.014), metal).moved(WIDTH - 0.0675 - GAP, y, top - 0.0265)
        for y in (south + 0.015, north - 0.015)
    ]
    cloths = [
        hanging_cloth((0.52, top - 0.04), 0.004, cloth, folds=6, depth=0.052).turned(90.0).moved(x, y, 0.02)
        for y in (south + 0.31, north - 0.31)
    ]
    return join([rod, *ends, *brackets, *cloths])


# The furniture


def rug(paint: dict[str, Material]) -> Shape:
    """A flat carpet with stripes of three colours, 11 mm thick."""
    cuts = np.array([0.0, 0.08, 0.14, 0.30, 0.36, 0.46, 0.52, 1.0, 1.48, 1.54, 1.64, 1.70, 1.86, 1.92, 2.0]) - 1.0
    cream, red, teal = paint["Cream cloth"], paint["Terracotta cloth"], paint["Teal cloth"]
    stripes = [cream, red, cream, teal, cream, red, cream]
    stripes += stripes[::-1]
    return lattice(cuts * 1.35, [-0.9, 0.0, 0.9], 0.011, lambda column, _: stripes[column])


def sofa(seats: int, cloth: Material, wood: Material) -> Shape:
    """A sofa that looks along -y: feet, base, arms, back, and cushions for each seat."""
    seat, arm, depth = 0.70, 0.19, 0.88
    inside = seats * seat
    feet = [
        lathe([(0.0, 0.0), (0.017, 0.0), (0.027, 0.11), (0.0, 0.11)], wood, 12).moved(x, y)
        for x in (-inside / 2.0 - 0.08, inside / 2.0 + 0.08)
        for y in (-depth / 2.0 + 0.09, depth / 2.0 - 0.09)
    ]
    base = rounded_box((inside - 2.0 * GAP, depth, 0.19), 0.025, cloth, steps=2).moved(z=0.11 + GAP)
    arms = [
        rounded_box((arm, depth, 0.47), 0.07, cloth, steps=2).moved(side * (inside + arm) / 2.0, 0.0, 0.11 + GAP)
        for side in (-1, 1)
    ]
    back = rounded_box((inside - 2.0 * GAP, 0.20, 0.52), 0.07, cloth, steps=2)
    back = back.moved(0.0, depth / 2.0 - 0.10, 0.30 + 2.0 * GAP)
    cushions = []
    for k in range(seats):
        x = (k - (seats - 1) / 2.0) * seat
        flat_cushion = rounded_box((seat - 0.03, 0.64, 0.13), 0.045, cloth, steps=2, bulge=0.012)
        cushions.append(flat_cushion.moved(x, -depth / 2.0 + 0.335, 0.30 + 2.0 * GAP))
        leaning = rounded_box((seat - 0.05, 0.13, 0.40), 0.055, cloth, steps=2, bulge=0.016)
        cushions.append(leaning.turned(-11.0, "X").moved(x, depth / 2.0 - 0.335, 0.475))
    return join([*feet, base, *arms, back, *cushions])


def pillows(paint: dict[str, Material]) -> Shape:
    """Loose pillows that lean on the sofa's cushions."""

    def pillow(material: Material, size: float) -> Shape:
        return rounded_box((size, 0.07, size), 0.034, material, steps=2, flat=3, bulge=0.04)

    return join(
        [
            pillow(paint["Teal cloth"], 0.40).turned(-20.0, "X").turned(-14.0).moved(-0.80, -0.13, 0.475),
            pillow(paint["Rose cloth"], 0.36).turned(-22.0, "X").turned(9.0).moved(-0.27, -0.19, 0.475),
            pillow(paint["Teal cloth"], 0.38).turned(-20.0, "X").turned(16.0).moved(0.78, -0.14, 0.475),
        ]
    )


def pouf(cloth: Material) -> Shape:
    """A round stool with a swelling belly, gathered into sixteen ribs."""
    angles = np.linspace(-pi / 2.0, pi / 2.0, 9)
    belly = [(0.17 + 0.12 * np.cos(a), 0.17 + 0.17 * np.sin(a)) for a in angles]
    stool = lathe([(0.0, 0.0), *belly, (0.09, 0.348), (0.0, 0.35)], cloth, 48)

    def gather(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
        rib = 1.0 + 0.035 * np.cos(16.0 * np.arctan2(y, x)) * np.clip(np.hypot(x, y) / 0.2, 0.0, 1.0)
        return x * rib, y * rib, z

    return stool.reshaped(gather)


def low_table(wood: Material) -> Shape:
    """A table 40 cm high with an oblong top and tapering legs."""
    legs = [
        lathe([(0.0, 0.0), (0.014, 0.0), (0.022, 0.365), (0.0, 0.365)], wood, 14).moved(x, y)
        for x in (-0.46, 0.46)
        for y in (-0.22, 0.22)
    ]
    top = rounded_box((1.1, 0.58, 0.034), 0.016, wood, steps=3, flat=3).moved(z=0.365 + GAP)
    return join([*legs, top])


def table_things(paint: dict[str, Material], books: list[Material]) -> Shape:
    """A bowl of oranges, a vase and a pile of three books."""
    bowl = lathe(
        [
            (0.0, 0.0),
            (0.05, 0.0),
            (0.055, 0.006),
            (0.10, 0.03),
            (0.135, 0.075),
            (0.129, 0.077),
            (0.095, 0.037),
            (0.05, 0.014),
            (0.0, 0.012),
        ],
        paint["Blue glaze"],
        24,
    ).moved(0.06, 0.03)
    nest = [(0.0, 0.075, 0.024), (0.066, -0.036, 0.024), (-0.066, -0.036, 0.024), (0.0, 0.0, 0.074)]
    oranges = [sphere(0.036, paint["Orange"], 14).moved(0.06 + 0.62 * x, 0.03 + 0.62 * y, z) for x, y, z in nest[:3]]
    oranges.append(sphere(0.035, paint["Orange"], 14).moved(0.06, 0.03, 0.0815))
    vase = lathe(
        [
            (0.0, 0.0),
            (0.045, 0.0),
            (0.07, 0.06),
            (0.075, 0.11),
            (0.05, 0.18),
            (0.028, 0.215),
            (0.036, 0.25),
            (0.031, 0.25),
            (0.023, 0.215),
            (0.045, 0.175),
            (0.0, 0.02),
        ],
        paint["Glaze"],
        24,
    ).moved(-0.36, 0.12)
    pile, z = [], 0.0
    for k, (colour, size, turn) in enumerate(
        [(5, (0.25, 0.18), 8.0), (0, (0.22, 0.16), -6.0), (2, (0.19, 0.14), 17.0)]
    ):
        thickness = 0.03 - 0.004 * k
        pile.append(box((*size, thickness), books[colour]).turned(turn).moved(0.36, -0.06, z))
        z += thickness + GAP
    return join([bowl, *oranges, vase, *pile])


SHELF_WIDTH, SHELF_DEPTH, SHELF_HEIGHT, BOARD = 1.25, 0.30, 2.06, 0.026
SHELF_LEVELS = [0.07, 0.44, 0.80, 1.13, 1.45, 1.76]


def bookshelf(wood: Material) -> Shape:
    """Two sides, a top, a back and a board for each level, all a hair apart."""
    inside = SHELF_WIDTH - 2.0 * BOARD - 2.0 * GAP
    sides = [
        box((BOARD, SHELF_DEPTH, SHELF_HEIGHT), wood).moved(side * (SHELF_WIDTH - BOARD) / 2.0) for side in (-1, 1)
    ]
    back = box((inside, 0.012, SHELF_HEIGHT - 0.03), wood).moved(0.0, SHELF_DEPTH / 2.0 - 0.007, 0.005)
    levels = [*SHELF_LEVELS, SHELF_HEIGHT - 0.004]
    deep = SHELF_DEPTH - 0.02
    shelves = [box((inside, deep, BOARD), wood).moved(0.0, -0.008, z - BOARD) for z in levels]
    return join([*sides, back, *shelves])


def shelved_books(books: list[Material], paint: dict[str, Material]) -> Shape:
    """Rows of books of many sizes and colours, with room left for an ornament in each."""
    choose = RandomState(21)
    shapes = []
    left, right = -SHELF_WIDTH / 2.0 + BOARD + 0.006, SHELF_WIDTH / 2.0 - BOARD - 0.006
    gaps = {0: (0.75, 1.0), 1: (0.0, 0.22), 2: (0.55, 0.80), 3: (0.80, 1.0), 4: (0.0, 0.28), 5: (0.40, 0.72)}
    for level, z in enumerate(SHELF_LEVELS):
        start, end = (left + share * (right - left) for share in gaps[level])
        x = left
        while True:
            thickness = choose.uniform(0.018, 0.046)
            if start - thickness < x < end:
                x = end
            if x + thickness > right:
                break
            size = (thickness, choose.uniform(0.15, 0.205), choose.uniform(0.185, 0.265))
            shapes.append(
                box(size, books[choose.randint(len(books))], top=paint["Paper"]).moved(
                    x + thickness / 2.0, -0.115 + size[1] / 2.0 + choose.uniform(0.0, 0.02), z + GAP
                )
            )
            x += thickness + 2.0 * GAP
        shapes.append(_ornament(level, paint).moved((start + end) / 2.0, -0.02, z + GAP))
    return join(shapes)


def _ornament(level: int, paint: dict[str, Material]) -> Shape:
    """What stands in the gap of a row of books."""
    jar = [(0.0, 0.0), (0.05, 0.0), (0.075, 0.07), (0.06, 0.15), (0.03, 0.17), (0.035, 0.20), (0.0, 0.20)]
    bottle = [(0.0, 0.0), (0.04, 0.0), (0.05, 0.09), (0.018, 0.16), (0.016, 0.23), (0.0, 0.23)]
    if level % 3 == 0:
        return lathe(jar, paint["Blue glaze" if level else "Terracotta"], 20)
    if level % 3 == 1:
        return sphere(0.07, paint["Brass" if level == 1 else "Rose cloth"], 18)
    return lathe(bottle, paint["Glaze" if level == 2 else "Teal cloth"], 20)


def floor_lamp(paint: dict[str, Material]) -> Shape:
    """A brass stand with a conical shade of cloth, open above and below."""
    stand = lathe(
        [
            (0.0, 0.0),
            (0.15, 0.0),
            (0.15, 0.014),
            (0.06, 0.026),
            (0.012, 0.034),
            (0.012, 1.40),
            (0.022, 1.405),
            (0.022, 1.44),
            (0.0, 1.44),
        ],
        paint["Brass"],
        32,
    )
    shade = lathe([(0.215, 1.34), (0.219, 1.34), (0.144, 1.66), (0.140, 1.66)], paint["Lamp shade"], 48, ring=True)
    return join([stand, shade])


def plant(paint: dict[str, Material]) -> Shape:
    """A pot with soil and arching leaves."""
    pot = lathe(
        [
            (0.0, 0.0),
            (0.125, 0.0),
            (0.165, 0.30),
            (0.178, 0.30),
            (0.182, 0.345),
            (0.162, 0.345),
            (0.157, 0.30),
            (0.0, 0.30),
        ],
        [*[paint["Terracotta"]] * 6, paint["Soil"]],
        36,
    )
    choose = RandomState(5)
    leaves = []
    # From the heart outward: each ring starts farther from the middle and stays below the one before.
    for ring, (count, start, reach, rise) in enumerate(
        [(3, 0.02, 0.10, 0.98), (6, 0.045, 0.24, 0.84), (8, 0.075, 0.38, 0.66), (9, 0.105, 0.44, 0.42)]
    ):
        for k in range(count):
            vary, width = choose.uniform(0.93, 1.07), choose.uniform(0.026, 0.036)
            leaf = sheet(
                _leaf(start, reach * vary, rise * vary, width), 0.003, paint[("Leaf", "Young leaf")[ring == 0]]
            )
            leaves.append(leaf.turned(360.0 * k / count + 31.0 * ring + choose.uniform(-4.0, 4.0)))
    return join([pot, *leaves])


def _leaf(start: float, reach: float, rise: float, width: float) -> np.ndarray:
    """A long leaf (n, 3, 3) that starts upright above the soil, arches over x and hangs at its tip."""
    t = np.linspace(0.0, 1.0, 8)
    x = start + reach * t**1.6
    z = 0.302 + rise * (t - 0.48 * t**3.2)
    half = width * (0.18 + np.sin(pi * np.clip(t, 0.0, 0.97) ** 0.75) * 0.9)
    fold = 0.35 * half
    return np.stack(
        [np.stack([x, side * half, z + abs(side) * fold], axis=-1) for side in (-1.0, 0.0, 1.0)],
        axis=1,
    )


def picture(paint: dict[str, Material]) -> Shape:
    """A framed landscape of layered paper: sky, sun and two ranges of hills."""
    width, height, bar = 1.30, 0.80, 0.035
    u, v = width / 2.0, height / 2.0
    frame = lattice(
        [-u, -u + bar, u - bar, u],
        [-v, -v + bar, v - bar, v],
        0.035,
        lambda i, j: None if i == j == 1 else paint["Walnut"],
    )
    u, v = u - bar - GAP, v - bar - GAP
    sky = prism([(-u, -v), (u, -v), (u, v), (-u, v)], 0.006, paint["Evening sky"])
    circle = [(0.20 + 0.13 * np.cos(a), 0.06 + 0.13 * np.sin(a)) for a in np.arange(40) * pi / 20.0]
    sun = prism(circle, 0.003, paint["Evening sun"]).moved(z=0.0065)
    far = prism(_hills(u, v, level=-0.02, swing=0.10, waves=3.1, phase=0.4), 0.004, paint["Far hill"]).moved(z=0.010)
    near = prism(_hills(u, v, level=-0.17, swing=0.09, waves=4.3, phase=2.2), 0.004, paint["Near hill"]).moved(z=0.0145)
    return join([frame, sky, sun, far, near]).turned(90.0, "X")


def _hills(u: float, v: float, *, level: float, swing: float, waves: float, phase: float) -> list[tuple[float, float]]:
    """The outline of a range of hills over the lower part of a picture of half size (u, v)."""
    x = np.linspace(u, -u, 41)
    ridge = level + swing * (np.sin(waves * x + phase) + 0.35 * np.sin(2.7 * waves * x))
    return [(-u, -v), (u, -v), *zip(x.tolist(), ridge.tolist(), strict=True)]


if __name__ == "__main__":
    build()
