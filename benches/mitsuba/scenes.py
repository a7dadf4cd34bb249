"""The scenes, said once: camera, environment, lights, objects = (mesh, material, body around it or None).

`SCENES[name]` has `tries` (what it is for), `method` of marmor and the rest. Lengths are mm.
A medium is sigma_s, sigma_a, g, eta; a clear body has sigma_s = 0. Lights and `optics` of the camera have marmor's own keys.
"""

import numpy as np

from shapes import ball, ball_uv, box, rectangle, torus


def rgb(x):
    return [float(x)] * 3 if isinstance(x, (int, float)) else [float(y) for y in x]


def matt(albedo):
    return {"kind": "diffuse", "albedo": rgb(albedo)}


def metal(n, k, roughness=0.0):
    return {"kind": "conductor", "n": rgb(n), "k": rgb(k), "roughness": roughness}


def mirror():
    """Of reflectance 1 from everywhere."""
    return {"kind": "conductor", "reflectance": 1.0, "roughness": 0.0}


def plastic(albedo, eta=1.5, roughness=0.0, ours=False):
    """`ours`: by surfaces.py in Mitsuba, as rough metals and rough matt surfaces are."""
    return {"kind": "plastic", "albedo": rgb(albedo), "eta": eta, "roughness": roughness, "ours": ours}


def clay(albedo, roughness):
    return {"kind": "diffuse", "albedo": rgb(albedo), "roughness": roughness}


def picture(image, wrap="repeat"):
    """`image`: a key of PICTURES."""
    return {"kind": "diffuse", "image": image, "wrap": wrap}


def lamp(radiance):
    return {"kind": "emissive", "radiance": rgb(radiance)}


def medium(sigma_s, sigma_a, g=0.0, eta=1.4):
    return {"kind": "medium", "sigma_s": rgb(sigma_s), "sigma_a": rgb(sigma_a), "g": g, "eta": eta}


def ground(body, roughness=0.15):
    """The same behind a boundary so slightly rough that what Mitsuba loses, light thrown from facet to facet, is below the noise."""
    return body | {"roughness": roughness}


def clear(eta, sigma_a=0.0):
    return {"kind": "clear", "sigma_a": rgb(sigma_a), "eta": eta}


def floor(albedo=0.5):
    return rectangle((0, 0, 0), (4, 0, 0), (0, 0, -4)), matt(albedo)


def ceiling_lamp(radiance=4.0, size=1.0, height=4.0, x=0.0, z=0.0):
    """Shines down."""
    return rectangle((x, height, z), (size, 0, 0), (0, 0, size)), lamp(radiance)


def back_lamp(radiance=6.0, size=1.3):
    """Behind, above and to the right, out of the picture, facing the middle."""
    n = np.array([-4.2, -2.0, 2.5]) / np.linalg.norm([4.2, 2.0, 2.5])
    u = np.cross([0, 1, 0], n) / np.linalg.norm(np.cross([0, 1, 0], n))
    return rectangle((4.2, 3, -2.5), list(map(float, size * u)), list(map(float, size * np.cross(n, u)))), lamp(radiance)


def room(white=0.7, side=1.0):
    """Closed, the camera inside: six walls, two of them coloured."""
    w, h, d, far = 3.0, 5.0, 3.0, 10.0
    mid, half = (far - d) / 2, (far + d) / 2
    r, g = (white, 0.25 * side * white, 0.2 * side * white), (0.2 * side * white, white, 0.3 * side * white)
    return [(rectangle((0, 0, mid), (w, 0, 0), (0, 0, -half)), matt(white)), (rectangle((0, h, mid), (w, 0, 0), (0, 0, half)), matt(white)),
            (rectangle((0, h / 2, -d), (w, 0, 0), (0, h / 2, 0)), matt(white)), (rectangle((0, h / 2, far), (-w, 0, 0), (0, h / 2, 0)), matt(white)),
            (rectangle((-w, h / 2, mid), (0, 0, -half), (0, h / 2, 0)), matt(r)), (rectangle((w, h / 2, mid), (0, 0, half), (0, h / 2, 0)), matt(g))]


def glow(lobes, even=0.3):
    """A smooth sky: lobes (direction, colour, sharpness) over an even grey, a function of an array of directions."""
    def radiance(d):
        out = np.full(d.shape, even)
        for w, colour, sharpness in lobes:
            cosine = d @ (np.array(w) / np.linalg.norm(w))
            out += np.exp(sharpness * (cosine - 1))[..., None] * np.array(colour)
        return out
    return radiance


SOFT = glow([((1, 1, 1), (3, 2, 1), 4), ((-1, 0.5, -1), (0.5, 1, 3), 6), ((0, -1, 0), (0.2, 0.4, 0.2), 3)])
SUN = glow([((0.7, 1, 0.4), (150, 130, 100), 150), ((-1, 0.5, -1), (0.5, 0.7, 1), 3)], 0.2)

MILK = medium((6, 6.5, 7), (0.0006, 0.002, 0.006), 0.0, 1.35)
MILK_FORWARD = medium((30, 32, 35), (0.0006, 0.002, 0.006), 0.8, 1.35)
MARBLE = medium((2.19, 2.62, 3.0), (0.0021, 0.0041, 0.0071), 0.0, 1.5)
WAX = medium((4, 3.5, 2.5), (0.01, 0.03, 0.15), 0.0, 1.4)
DARK = medium((1, 1.5, 2), (1, 1.5, 2), 0.0, 1.4)
JELLY = medium((0.4, 0.3, 0.2), (0.05, 0.15, 0.3), 0.5, 1.35)
COLOURED = medium((0.4, 3, 15), (0.1, 0.02, 0.3), 0.0, 1.3)
BALL, CUBE = ball((0, 1.05, 0), 1.0), box((-0.9, 0.05, -0.9), (0.9, 1.85, 0.9), 30)
# Of a box: its upper and its lower face.
LID, BASE = ([f for f in CUBE[1] if all(CUBE[0][i][1] == y for i in f)] for y in (1.85, 0.05))
SCENES = {}


def add(name, tries, method, objects, sky=None, camera=((0, 2.5, 8.5), (0, 1.1, 0), 28), inside=None, bounces=None, faces=None, lights=(), optics=None):
    """An object is (mesh, material) or (mesh, material, index of the body that it lies in). `inside` is the body that the camera is
    in; `faces`, for Mitsuba in place of the objects where bodies touch: each (mesh, body inside it or its material, body outside);
    `optics`: of the camera, beside or in place of the pinhole."""
    SCENES[name] = {"tries": tries, "method": method, "objects": [o if len(o) == 3 else (*o, None) for o in objects],
                    "sky": sky, "camera": camera, "inside": inside, "bounces": bounces, "faces": faces, "lights": list(lights), "optics": optics or {}}


def opaque():
    panels = [(rectangle((x, y, z), (0.5, 0.1, 0), (0, 0.4, 0.2)), lamp(c)) for x, y, z, c in
              [(-1, 2, 0, (1, 0, 0)), (1, 2, -1, (0, 1, 0)), (-1, 0.3, 1, (0, 0, 1)), (1, 0.3, 0, (1, 1, 1)), (0, 1.2, -2, (3, 2, 1))]]
    add("panels", "camera: panels of five colours, seen", "path", panels)
    add("cube_area", "cube and ball on a floor, area lamp", "path", [floor(), (CUBE, matt((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 1), 0.5), matt(0.6)), ceiling_lamp()])
    add("cube_sky", "the same under an even sky", "path", [floor(), (CUBE, matt((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 1), 0.5), matt(0.6))], 1.0)
    add("cube_image", "the same under a smooth picture", "path", [floor(), (CUBE, matt((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 1), 0.5), matt(0.6))], SOFT)
    add("cube_sun", "the same under a picture with a sun", "path", [floor(), (CUBE, matt((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 1), 0.5), matt(0.6))], SUN)
    add("room_area", "closed room, area lamp", "path", room() + [(CUBE, matt(0.6)), ceiling_lamp(4, 1, 4.9)])
    add("room_direct", "the same, light straight from the lamp", "path", room() + [(CUBE, matt(0.6)), ceiling_lamp(4, 1, 4.9)], bounces=0)
    add("room_twice", "the same, over two more surfaces at most", "path", room() + [(CUBE, matt(0.6)), ceiling_lamp(4, 1, 4.9)], bounces=2)
    add("room_bright", "closed room of albedo 0.95", "path", room(0.95, 3) + [(BALL, matt(0.9)), ceiling_lamp(1, 1, 4.9)])
    add("room_small", "closed room, small bright lamp", "path", room() + [(BALL, matt(0.6)), ceiling_lamp(2000, 0.04, 3, 0.5, 1)])
    add("room_hidden", "closed room, the lamp behind a screen", "path", room() + [(CUBE, matt(0.6)), ceiling_lamp(10, 0.6, 4.5), (box((-1, 3.9, -1), (1, 4, 1)), matt(0.5))])
    add("near_lamp", "torus 0.02 from a lamp", "path", [floor(), (torus((0, 1, 0), 0.9, 0.35), matt(0.6)), (rectangle((-1.3, 1, 0), (0, 0, 1), (0, 0.8, 0)), lamp((3, 2, 1))),
                                                        ceiling_lamp(0.5)])
    lamps = [ceiling_lamp(([8, 2, 1], [1, 8, 2], [1, 2, 8])[(i + k) % 3], 0.15, 2.5 + 0.3 * i, -1.5 + i, -1.5 + k) for i in range(4) for k in range(4)]
    add("lamps16", "16 lamps of three colours", "path", [floor(), (CUBE, matt(0.6))] + lamps)
    add("bodies16", "the same, a marble ball in place of the cube", "volume_path", [floor(), (BALL, MARBLE)] + lamps)


def glass():
    add("glass_image", "clear ball, picture", "volume_path", [floor(), (BALL, clear(1.5))], SOFT)
    add("glass_area", "clear cube, area lamp: caustics", "volume_path", [floor(), (CUBE, clear(1.4)), ceiling_lamp(2, 2)])
    add("glass_absorbs", "absorbing ball, even sky", "volume_path", [floor(), (BALL, clear(1.33, (0.1, 0.5, 1.5)))], 1.0)
    add("glass_room", "absorbing ball in a closed room", "volume_path", room() + [(BALL, clear(1.5, (0.5, 0.1, 0.02))), ceiling_lamp(3, 2, 4.9)])
    add("glass_bubble", "air bubble in an absorbing cube", "volume_path", [floor(), (CUBE, clear(1.5, (0.4, 0.1, 0.02))), (ball((0, 0.95, 0), 0.5), clear(1.0), 1)], SOFT)
    add("glass_in_glass", "absorbing ball in an absorbing ball", "volume_path", [floor(), (BALL, clear(1.3, (0.1, 0.1, 0.4))), (ball((0.1, 1, 0.1), 0.6), clear(1.6, (0.8, 0.2, 0.1)), 1)], SOFT)


def fog():
    add("fog_sky", "eta 1, isotropic, even sky", "volume_path", [floor(), (CUBE, medium(2, 0.02, 0, 1))], 1.0)
    add("fog_small", "eta 1, coloured, small lamp, black floor", "volume_path", [floor(0.0), (CUBE, medium((0.5, 1, 3), (0.1, 0.05, 0.02), 0, 1)), ceiling_lamp(400, 0.1, 3)])
    add("fog_area", "eta 1, coloured, area lamp", "volume_path", [floor(), (CUBE, medium((0.5, 1, 3), (0.1, 0.05, 0.02), 0, 1)), ceiling_lamp(4, 1, 3)])
    add("fog_forward", "eta 1, g = 0.8, area lamp behind", "volume_path", [floor(), (BALL, medium(6, 0.05, 0.8, 1)), back_lamp()])
    add("fog_back", "eta 1, g = -0.5, area lamp", "volume_path", [floor(), (BALL, medium(3, 0.1, -0.5, 1)), ceiling_lamp()])
    add("fog_absorbs", "eta 1, albedo 0.3, picture", "volume_path", [floor(), (BALL, medium((0.3, 0.6, 1.2), (0.7, 1.4, 2.8), 0.3, 1))], SOFT)
    add("fog_room", "eta 1, coloured, closed room", "volume_path", room() + [(BALL, medium((4, 1, 0.3), (0.02, 0.2, 0.1), 0, 1)), ceiling_lamp(4, 1, 4.9)])
    add("fog_camera", "eta 1, the camera in the medium, area lamp", "volume_path", [(box((-5, -1, -5), (5, 6, 10)), medium((0.1, 0.12, 0.15), (0.01, 0.01, 0.02), 0.5, 1)), (*floor(), 0), (CUBE, matt(0.6), 0), (*ceiling_lamp(), 0)],
        inside=0)


def bodies():
    add("milk_sky", "milk, even sky", "volume_path", [floor(), (BALL, MILK)], 1.0)
    add("milk_area", "milk, area lamp behind", "volume_path", [floor(), (BALL, MILK), back_lamp()])
    add("milk_forward", "milk of g = 0.8, area lamp", "volume_path", [floor(), (CUBE, MILK_FORWARD), ceiling_lamp(3, 2)])
    add("milk_room", "milk in a closed room", "volume_path", room() + [(BALL, MILK), ceiling_lamp(3, 2, 4.9)])
    add("milk_small", "milk, lamp of 0.6 mm", "volume_path", [floor(0.0), (CUBE, MILK), ceiling_lamp(60, 0.3, 2.6, 0.5, 1.5)])
    add("ground_sky", "milk behind a rough boundary, even sky", "volume_path", [floor(), (BALL, ground(MILK))], 1.0)
    add("ground_area", "milk behind a rough boundary, area lamp behind", "volume_path", [floor(), (BALL, ground(MILK)), back_lamp()])
    add("ground_image", "marble torus behind a rough boundary, picture", "volume_path", [floor(), (torus((0, 1.2, 0), 0.9, 0.4), ground(MARBLE))], SOFT)
    add("ground_below_1", "rough boundary, eta 0.75, picture", "volume_path", [floor(), (BALL, ground(medium(2, (0.02, 0.1, 0.3), 0.4, 0.75)))], SOFT)
    add("ground_lights", "absorbing cube of eta 1.6 behind a rough boundary, point and distant light", "volume_path", [floor(0.1), (CUBE, ground(medium(1, (1, 2, 4), 0, 1.6), 0.2))], lights=[POINT, DISTANT])
    add("marble_area", "marble, area lamp behind", "volume_path", [floor(), (BALL, MARBLE), back_lamp()])
    add("marble_image", "marble torus, picture", "volume_path", [floor(), (torus((0, 1.2, 0), 0.9, 0.4), MARBLE)], SOFT)
    add("marble_sun", "marble cube, picture with a sun", "volume_path", [floor(), (CUBE, MARBLE)], SUN)
    add("marble_room", "marble cube in a closed room", "volume_path", room() + [(CUBE, MARBLE), ceiling_lamp(3, 2, 4.9)])
    add("wax_furnace", "white medium, white floor, white sky: 1 in closed form", "volume_path", [floor(1.0), (CUBE, medium(3, 0, 0.3, 1.4))], 1.0)
    add("dark_area", "albedo 0.5, area lamp", "volume_path", [floor(), (BALL, DARK), ceiling_lamp(4, 2)])
    add("dark_forward", "albedo 0.5, g = 0.8, picture", "volume_path", [floor(), (CUBE, medium((2, 4, 8), (2, 4, 8), 0.8, 1.5))], SOFT)
    add("coloured_sky", "extinction 0.5 to 15, even sky", "volume_path", [floor(), (BALL, COLOURED)], 1.0)
    add("coloured_area", "extinction 0.5 to 15, area lamp", "volume_path", [floor(), (CUBE, COLOURED), ceiling_lamp(3, 2)])
    add("sheet", "thin sheet, lamp behind", "volume_path", [floor(), (box((-1.2, 0.05, -0.1), (1.2, 2.4, 0.1), 20), WAX), back_lamp()])
    add("below_1", "eta 0.75, picture", "volume_path", [floor(), (BALL, medium(2, (0.02, 0.1, 0.3), 0.4, 0.75))], SOFT)
    add("void_channel", "red meets hardly anything, green does not absorb; picture", "volume_path", [floor(), (BALL, medium((0.001, 1.5, 4), (0, 0, 0.5), 0.2, 1.3))], SOFT)
    add("dense_index", "eta 2, g = -0.7, picture", "volume_path", [floor(), (CUBE, medium((2, 1, 0.5), (0.02, 0.1, 0.2), -0.7, 2.0))], SOFT)
    add("needle", "g = 0.95, area lamp, even sky", "volume_path", [floor(), (BALL, medium(40, (0.02, 0.1, 0.5), 0.95, 1.4)), ceiling_lamp(3, 2)], 0.3)
    add("sunk", "a cube sunk in the floor", "volume_path", [floor(), (box((-0.9, -0.6, -0.9), (0.9, 1.2, 0.9), 30), JELLY)], SOFT)
    add("two_bodies", "milk beside wax, picture", "volume_path", [floor(), (ball((-0.8, 0.8, 0), 0.75), MILK), (box((0.1, 0.05, -0.6), (1.3, 1.25, 0.6), 20), WAX)], SOFT)
    add("glass_beside", "glass beside milk in a closed room", "volume_path", room() + [(ball((-0.9, 0.9, 0.4), 0.8), clear(1.5)), (ball((0.9, 0.9, 0), 0.85), MILK), ceiling_lamp(3, 2, 4.9)])


def nested():
    add("milk_in_glass", "milk in a glass ball, even sky", "volume_path", [floor(), (BALL, clear(1.5)), (ball((0, 1, 0), 0.7), MILK, 1)], 1.0)
    add("bubble_in_wax", "air bubble in wax, area lamp behind", "volume_path", [floor(), (CUBE, WAX), (ball((0.2, 1, 0.2), 0.5), clear(1.0), 1), back_lamp()])
    add("dark_in_jelly", "medium in a medium, picture", "volume_path", [floor(), (CUBE, JELLY), (ball((0, 0.95, 0), 0.6), DARK, 1)], SOFT)
    add("stone_in_jelly", "opaque ball in a medium, even sky", "volume_path", [floor(), (CUBE, JELLY), (ball((0, 0.95, 0), 0.6), matt((0.8, 0.4, 0.2)), 1)], 1.0)
    add("lamp_in_jelly", "lamp in a medium", "volume_path", [floor(), (CUBE, JELLY), (ball((0, 0.95, 0), 0.4), lamp((2, 3, 4)), 1)])
    add("shells", "glass, milk, glass, wax in one another", "volume_path", [floor(), (BALL, clear(1.4)), (ball((0, 1.05, 0), 0.85), JELLY, 1), (ball((0, 1.05, 0), 0.6), clear(1.5, 0.2), 2), (ball((0, 1.05, 0), 0.4), WAX, 3)], SOFT)
    add("camera_in_glass", "the camera in a clear body of eta 1.3 that has an opaque cube in it", "volume_path", [floor(), (box((-3.5, 0.02, -3.5), (3.5, 5, 9)), clear(1.3, (0.05, 0.02, 0.01))), (CUBE, matt(0.6), 1)], SOFT, inside=1)
    add("camera_in_jelly", "the camera in a medium of eta 1.35 that has an opaque cube in it", "volume_path", [floor(), (box((-3.5, 0.02, -3.5), (3.5, 5, 9)), medium((0.08, 0.06, 0.04), (0.01, 0.02, 0.03), 0.5, 1.35)), (CUBE, matt(0.6), 1)], SOFT, inside=1)
    lower, upper = box((-0.9, 0.05, -0.9), (0.9, 1.0, 0.9), 30), box((-0.9, 1.0, -0.9), (0.9, 1.9, 0.9), 30)
    without = lambda mesh, lid: (mesh[0], [f for f in mesh[1] if f not in lid])
    faces = [(floor()[0], matt(0.5), None), (without(lower, LID), 1, None), (without(upper, BASE), 2, None), ((lower[0], LID), 1, 2)]
    for name, tries, mesh in (("contact", "a medium under a clear body, faces in contact", upper), ("overlap", "the same, said by priority of bodies that overlap", box((-0.9, 0.5, -0.9), (0.9, 1.9, 0.9), 30))):
        add(name, tries, "volume_path", [floor(), (lower, dict(JELLY, **({"priority": 1} if name == "overlap" else {}))), (mesh, clear(1.5, (0.1, 0.2, 0.4)))], SOFT, faces=faces)
    add("nested_room", "wax in glass in a closed room", "volume_path", room() + [(BALL, clear(1.5, (0.1, 0.05, 0.01))), (box((-0.45, 0.6, -0.45), (0.45, 1.4, 0.45), 30), WAX, 6), ceiling_lamp(3, 2, 4.9)])


def noise(width, height, seed):
    """Rows of colours from the top down: an even noise on slopes, no two quarters alike."""
    y, x = np.meshgrid(np.arange(height) / height, np.arange(width) / width, indexing="ij")
    slopes = np.stack([0.1 + 0.6 * x, 0.1 + 0.6 * y, 0.7 - 0.3 * x - 0.3 * y], axis=-1)
    return slopes + 0.3 * np.random.default_rng(seed).random((height, width, 3))


# 8 bits in sRGB, and linear floats; few pixels, so that what lies between them counts.
PICTURES = {"tiles.png": noise(13, 9, 1), "blots.exr": noise(10, 14, 2)}
# n and k of docs/scene-format.md.
GOLD, COPPER, SILVER = ((0.509, 0.689, 1.640), (3.192, 2.459, 1.745)), ((0.338, 0.943, 1.158), (3.096, 2.594, 2.451)), ((0.266, 0.251, 0.233), (4.093, 3.566, 2.787))
DISTANT = {"type": "distant", "direction": [-0.6, -1.0, -0.5], "irradiance": [3.0, 2.8, 2.4]}
SUN_3 = {"type": "sun", "direction": [-0.6, -1.0, -0.5], "irradiance": [3.0, 2.8, 2.4], "angle": 3.0}
OTHER = {"type": "distant", "direction": [0.8, -1.0, -0.2], "irradiance": [0.2, 0.5, 0.3]}
SUN_40 = {"type": "sun", "direction": [0.7, -1.0, -0.3], "irradiance": [2.0, 2.8, 3.0], "angle": 40.0}
POINT = {"type": "point", "position": [1.5, 3.5, 2.5], "intensity": [12.0, 10.0, 7.0]}
SPOT = {"type": "spot", "position": [-2.0, 4.0, 3.0], "look_at": [0.2, 0.8, 0.2], "cone": 36.0, "penumbra": 0.0, "intensity": [25.0, 30.0, 40.0]}
SOFT_SPOT = {"type": "spot", "position": [-2.0, 4.0, 3.0], "look_at": [0.2, 0.8, 0.2], "cone": 60.0, "penumbra": 0.8, "intensity": [25.0, 30.0, 40.0]}
# Name, what it is, lights, whether a lamp, sky.
EVERY_LIGHT = [("area", "area lamp", [], True, None), ("sky", "even sky", [], False, 1.0), ("image", "picture", [], False, SOFT), ("sun", "sun of 3 degrees", [SUN_3], False, None),
               ("distant", "distant light", [DISTANT], False, None), ("point", "point", [POINT], False, None), ("spot", "spot without penumbra", [SPOT], False, None)]


def delta_lights():
    things = [floor(), (CUBE, matt((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 1), 0.5), matt(0.6))]
    for name, tries, lights, _, _ in EVERY_LIGHT[3:]:
        add(f"cube_{name}" if name != "sun" else "cube_disk", f"cube and ball on a floor, {tries}", "path", things, lights=lights)
    add("cube_wide", "the same, sun of 40 degrees before an even sky", "path", things, 0.3, lights=[SUN_40])
    add("cube_penumbra", "the same, spot with a penumbra of 0.8", "path", things, lights=[SOFT_SPOT])
    add("cube_every", "the same, every kind of light at once", "path", things + [ceiling_lamp(2.0)], 0.2, lights=[SUN_3, OTHER, POINT, SPOT])
    add("room_point", "closed room, point", "path", room() + [(CUBE, matt(0.6))], lights=[POINT])
    add("room_spot", "closed room, spot without penumbra", "path", room() + [(CUBE, matt(0.6))], lights=[SPOT])


def shiny():
    cube, right, left = CUBE, ball((1.6, 0.5, 1), 0.5), ball((-1.5, 0.4, 1.2), 0.4)
    metals = [floor(0.3), (cube, metal(*COPPER, 0.5)), (right, metal(*GOLD)), (left, metal(*SILVER, 0.3))]
    plastics = [floor(0.3), (cube, plastic((0.7, 0.5, 0.3))), (right, plastic((0.2, 0.4, 0.7), 1.5, 0.1)), (left, plastic(0.0, 1.8, 0.15))]
    clays = [floor(0.3), (cube, plastic((0.7, 0.5, 0.3), 1.5, 0.5, True)), (right, clay((0.8, 0.4, 0.3), 0.7)), (left, clay(0.95, 1.0))]
    for kind, what, things in (("metal", "rough copper cube, smooth gold ball, rough silver ball", metals), ("plastic", "smooth cube, rough ball, rough black ball of eta 1.8", plastics),
                               ("clay", "rough plastic cube, two rough matt balls", clays)):
        for i, (name, tries, lights, lit, sky) in enumerate(EVERY_LIGHT):
            add(f"{kind}_{name}", f"{what}; {tries}" if i == 0 else f"the same, {tries}", "path", things + ([ceiling_lamp()] if lit else []), sky, lights=lights)
        add(f"{kind}_every", "the same, every kind of light at once", "path", things + [ceiling_lamp(2.0)], 0.2, lights=[SUN_3, OTHER, POINT, SOFT_SPOT])
    add("mirror_room", "closed room, mirror cube of reflectance 1, gold ball, area lamp", "path", room() + [(CUBE, mirror()), (ball((1.6, 0.5, 1), 0.5), metal(*GOLD)), ceiling_lamp(4, 1, 4.9)])
    add("plastic_room", "closed room, smooth and rough plastic, area lamp", "path", room() + [(CUBE, plastic((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 1), 0.5), plastic(0.8, 1.5, 0.1)), ceiling_lamp(4, 1, 4.9)])


def pictures():
    ground, wall = floor()[0], rectangle((0, 1.6, -2), (2.6, 0, 0), (0, 1.6, 0))
    things = [((*ground, [[-0.7, -0.4], [2.3, -0.4], [2.3, 1.9], [-0.7, 1.9]]), picture("tiles.png")), ((*wall, [[-0.3, -0.2], [1.2, 0.1], [1.3, 1.2], [-0.2, 1.1]]), picture("blots.exr", "clamp")),
              ((*BALL, ball_uv()), picture("blots.exr"))]
    for i, (name, tries, lights, lit, sky) in enumerate(EVERY_LIGHT):
        what = "floor with 13x9 pixels of sRGB repeated, wall and ball with 10x14 linear ones, clamped and repeated"
        add(f"picture_{name}", f"{what}; {tries}" if i == 0 else f"the same, {tries}", "path", things + ([ceiling_lamp()] if lit else []), sky, lights=lights)


def cameras():
    panels = SCENES["panels"]["objects"]
    things = [floor(), (CUBE, matt((0.7, 0.5, 0.3))), (ball((1.6, 0.5, 3), 0.5), metal(*GOLD))]
    add("lens_panels", "lens of 0.8, the panels, seen", "path", panels, optics={"aperture": 0.8})
    add("lens_near", "lens of 1.6 focused on a near ball, even sky", "path", things, 1.0, optics={"aperture": 1.6, "focus": 5.6})
    add("parallel_panels", "parallel rays, the panels, seen", "path", panels, optics={"projection": "orthographic", "height": 4.2})
    add("parallel_sun", "parallel rays, cube and ball, sun of 3 degrees", "path", things, lights=[SUN_3], optics={"projection": "orthographic", "height": 4.0})
    add("shift_panels", "view moved by 0.15 and -0.1, the panels, seen", "path", panels, optics={"shift": [0.15, -0.1]})


def lit_media():
    thin = medium((0.5, 1, 3), (0.1, 0.05, 0.02), 0, 1)
    add("fog_distant", "eta 1, coloured, distant light", "volume_path", [floor(), (CUBE, thin)], lights=[DISTANT])
    add("fog_point", "eta 1, g = 0.5, point", "volume_path", [floor(), (BALL, medium(3, (0.05, 0.1, 0.2), 0.5, 1))], lights=[POINT])
    add("fog_spot", "eta 1, spot without penumbra", "volume_path", [floor(), (CUBE, thin)], lights=[SPOT])
    add("fog_penumbra", "eta 1, g = -0.5, spot with a penumbra of 0.8", "volume_path", [floor(), (BALL, medium(3, 0.1, -0.5, 1))], lights=[SOFT_SPOT])
    add("fog_disk", "eta 1, sun of 3 degrees", "volume_path", [floor(), (CUBE, thin)], lights=[SUN_3])
    add("fog_every", "eta 1, every kind of light at once", "volume_path", [floor(), (BALL, thin), ceiling_lamp(2.0)], 0.2, lights=[SUN_3, OTHER, POINT, SOFT_SPOT])
    add("fog_beam", "eta 1, the camera in the medium, spot without penumbra", "volume_path", [(box((-5, -1, -5), (5, 3.9, 10)), medium((0.1, 0.12, 0.15), (0.01, 0.01, 0.02), 0.5, 1)), (*floor(), 0), (CUBE, matt(0.6), 0)],
        inside=0, lights=[SPOT])
    add("fog_shiny", "eta 1, before rough copper and plastic, point", "volume_path", [floor(), (box((-1.2, 0.05, 0.3), (1.2, 1.9, 0.9)), medium((0.4, 0.6, 0.9), (0.1, 0.05, 0.02), 0, 1)), (box((-1.1, 0.1, -1.2), (-0.1, 1.5, -0.2), 20), metal(*COPPER, 0.4)),
        (ball((0.7, 0.7, -0.7), 0.65), plastic((0.2, 0.4, 0.7), 1.5, 0.1))], lights=[POINT])
    add("stain_shiny", "clear, absorbing, eta 1, over rough copper and plastic, distant light", "volume_path", [floor(), (box((-1.5, 2.0, -1.5), (1.5, 2.6, 1.5)), clear(1.0, (0.1, 0.5, 1.5))), (box((-1.1, 0.1, -0.7), (-0.1, 1.5, 0.3), 20), metal(*COPPER, 0.4)),
        (ball((0.7, 0.7, -0.2), 0.65), plastic((0.2, 0.4, 0.7), 1.5, 0.1))], lights=[DISTANT])
    add("milk_wide", "milk, sun of 40 degrees before an even sky", "volume_path", [floor(), (BALL, MILK)], 0.3, lights=[SUN_40])
    add("marble_wide", "marble cube, sun of 40 degrees", "volume_path", [floor(), (CUBE, MARBLE)], lights=[SUN_40])
    add("milk_metal", "milk beside smooth gold and smooth plastic, even sky", "volume_path", [floor(), (ball((-0.8, 0.8, 0), 0.75), MILK), (box((0.1, 0.05, -0.6), (1.3, 1.25, 0.6), 20), plastic((0.7, 0.5, 0.3))), (ball((0.3, 0.35, 1.3), 0.35), metal(*GOLD))], 1.0)
    add("metal_in_jelly", "rough copper ball in a medium, area lamp", "volume_path", [floor(), (CUBE, JELLY), (ball((0, 0.95, 0), 0.6), metal(*COPPER, 0.4), 1), ceiling_lamp(3, 2)])
    add("plastic_in_jelly", "smooth plastic ball in a medium, picture", "volume_path", [floor(), (CUBE, JELLY), (ball((0, 0.95, 0), 0.6), plastic((0.7, 0.5, 0.3)), 1)], SOFT)
    add("glass_point", "clear ball on a floor, point", "volume_path", [floor(), (BALL, clear(1.5, (0.1, 0.05, 0.01)))], lights=[POINT])
    add("glass_wide", "clear ball on a floor, sun of 40 degrees", "volume_path", [floor(), (BALL, clear(1.5, (0.1, 0.05, 0.01)))], lights=[SUN_40])
    add("glass_plastic", "clear ball on smooth plastic, beside gold, picture", "volume_path", [(floor()[0], plastic((0.7, 0.5, 0.3))), (BALL, clear(1.5)), (ball((1.6, 0.5, 1), 0.5), metal(*GOLD))], SOFT)


opaque()
glass()
fog()
bodies()
nested()
delta_lights()
shiny()
pictures()
cameras()
lit_media()
