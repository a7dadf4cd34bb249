"""One description -> marmor's TOML with OBJ files, and Mitsuba's dictionary over the same OBJ files."""

from pathlib import Path

import mitsuba as mi
import numpy as np

SKY_SIZE = (1024, 512)


def obj_file(path, mesh):
    points, faces = mesh
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")


def sky_file(path, radiance, rows_at_poles):
    """The function at the places of the pixels: marmor has the rows' middles between the poles, Mitsuba the first and last row on them."""
    w, h = SKY_SIZE
    rows, columns = np.meshgrid(np.arange(h), np.arange(w), indexing="ij")
    theta, phi = np.pi * (rows / (h - 1) if rows_at_poles else (rows + 0.5) / h), 2 * np.pi * (columns + 0.5) / w
    directions = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)
    pixels = radiance(directions).astype(np.float32)
    mi.Bitmap(pixels).write(str(path))


def meshes(scene, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for i, (mesh, _, _) in enumerate(scene["objects"]):
        obj_file(folder / f"{i}.obj", mesh)
    for i, (mesh, _, _) in enumerate(scene["faces"] or []):
        obj_file(folder / f"face{i}.obj", mesh)
    if callable(scene["sky"]):
        for name, at_poles in (("sky", False), ("sky_mitsuba", True)):
            if not (folder / f"{name}.exr").exists():
                sky_file(folder / f"{name}.exr", scene["sky"], at_poles)


def marmor_file(scene, folder, size):
    position, look_at, fov = scene["camera"]
    out = ['unit = "mm"', "[camera]", f"position = {list(position)}", f"look_at = {list(look_at)}", f"fov = {fov}", f"resolution = {[size, size]}"]
    for i, (_, m, _) in enumerate(scene["objects"]):
        out += ["[[object]]", f'mesh = "{i}.obj"', 'normals = "geometric"', f'material = "m{i}"']
        kind = {"medium": "translucent", "clear": "dielectric"}.get(m["kind"], m["kind"])
        if "priority" in m:
            out.append(f"priority = {m['priority']}")
        out += [f"[material.m{i}]", f'type = "{kind}"'] + [f"{k} = {v}" for k, v in m.items() if k not in ("kind", "priority")]
    if scene["sky"] is not None:
        out += ["[environment]", 'image = "sky.exr"' if callable(scene["sky"]) else f"radiance = {scene['sky']}"]
    out += ["[method]", f'name = "{scene["method"]}"']
    if scene["bounces"] is not None:
        out.append(f"bounces = {scene['bounces']}")
    (folder / "scene.toml").write_text("\n".join(out) + "\n")
    return folder / "scene.toml"


def spectrum(values):
    return {"type": "rgb", "value": [float(v) for v in values]}


def mitsuba_medium(m):
    """None for what neither scatters nor absorbs."""
    s, a = np.array(m.get("sigma_s", [0.0] * 3)), np.array(m["sigma_a"])
    if not (s + a).any():
        return None
    phase = {"type": "hg", "g": m["g"]} if m.get("g") else {"type": "isotropic"}
    scale = float((s + a).max())  # its colours are at most 1
    return {"type": "homogeneous", "albedo": spectrum(s / np.where(s + a > 0, s + a, 1)), "sigma_t": spectrum((s + a) / scale), "scale": scale, "phase": phase}


def opaque(m):
    if m["kind"] == "diffuse":
        return {"bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": spectrum(m["albedo"])}}}
    return {"bsdf": {"type": "diffuse", "reflectance": spectrum([0, 0, 0])}, "emitter": {"type": "area", "radiance": spectrum(m["radiance"])}}


NO_ROULETTE = 1000000
# Of media. Without roulette: Mitsuba's ends a path with 5 % at least at every collision, whatever its weight, and of a path in milk
# with hundreds of them nothing is left but rare bright samples. The others are for the comparison of cost: the best of them counts.
SETTINGS = {"mitsuba": {"type": "volpathmis", "rr_depth": NO_ROULETTE}, "mitsuba-roulette": {"type": "volpathmis"},
            "mitsuba-plain": {"type": "volpath", "rr_depth": NO_ROULETTE}, "mitsuba-plain-roulette": {"type": "volpath"}}


def mitsuba_scene(scene, folder, size, setting="mitsuba", integrator=None):
    objects = scene["objects"]
    bodies = [m["kind"] in ("medium", "clear") for _, m, _ in objects]
    media = {i: mitsuba_medium(m) for i, (_, m, _) in enumerate(objects) if bodies[i]}
    medium_ref = {i: f"medium{i}" for i, m in media.items() if m}
    position, look_at, fov = scene["camera"]
    sensor = {"type": "perspective", "fov": fov, "fov_axis": "y", "near_clip": 1e-3, "far_clip": 1e4,
              "to_world": mi.ScalarTransform4f().look_at(origin=list(position), target=list(look_at), up=[0, 1, 0]),
              "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"},
              "sampler": {"type": "independent"}}
    out = {"type": "scene", "sensor": sensor}
    for i, name in medium_ref.items():
        out[name] = dict(media[i], id=name)
    if scene["inside"] is not None:
        sensor["medium"] = {"type": "ref", "id": medium_ref[scene["inside"]]}
    faces = scene["faces"] or [(None, i if bodies[i] else m, around) for i, (_, m, around) in enumerate(objects)]
    for i, (mesh, inside, around) in enumerate(faces):
        shape = {"type": "obj", "filename": str(folder / f"{'face' if mesh else ''}{i}.obj"), "face_normals": True}
        if not isinstance(inside, int):
            out[f"object{i}"] = dict(shape, **opaque(inside))
            continue
        eta, outside = objects[inside][1]["eta"], 1.0 if around is None else objects[around][1]["eta"]
        shape["bsdf"] = {"type": "null"} if eta == outside else {"type": "dielectric", "int_ior": eta, "ext_ior": outside}
        for side, body in (("interior", inside), ("exterior", around)):
            if body in medium_ref:
                shape[side] = {"type": "ref", "id": medium_ref[body]}
        out[f"object{i}"] = shape
    if callable(scene["sky"]):
        out["sky"] = {"type": "envmap", "filename": str(folder / "sky_mitsuba.exr")}
    elif scene["sky"] is not None:
        out["sky"] = {"type": "constant", "radiance": spectrum([scene["sky"]] * 3)}
    plain = {"type": "path", "max_depth": -1 if scene["bounces"] is None else scene["bounces"] + 2}
    volume = dict(SETTINGS[setting], max_depth=-1)
    out["integrator"] = integrator or (volume if medium_ref else plain)
    return out
