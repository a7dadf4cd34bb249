"""One description -> marmor's TOML with OBJ files, and Mitsuba's dictionary over the same OBJ files."""

from pathlib import Path

import mitsuba as mi
import numpy as np

import scenes

SKY_SIZE = (1024, 512)
# Of the disk that is a sun to Mitsuba: over 10^3 times the scene.
SUN_DISTANCE = 2e4


def obj_file(path, mesh):
    """A mesh is corners and faces, and texture coordinates of the corners if it has any."""
    points, faces, uv = mesh if len(mesh) == 3 else (*mesh, [])
    corner = (lambda i: f"{i + 1}/{i + 1}") if uv else (lambda i: f"{i + 1}")
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points] + [f"vt {u:.9g} {v:.9g}" for u, v in uv] + ["f " + " ".join(map(corner, f)) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def sky_file(path, radiance, rows_at_poles):
    """The function at the places of the pixels: marmor has the rows' middles between the poles, Mitsuba the first and last row on them."""
    w, h = SKY_SIZE
    rows, columns = np.meshgrid(np.arange(h), np.arange(w), indexing="ij")
    theta, phi = np.pi * (rows / (h - 1) if rows_at_poles else (rows + 0.5) / h), 2 * np.pi * (columns + 0.5) / w
    directions = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)
    pixels = radiance(directions).astype(np.float32)
    mi.Bitmap(pixels).write(str(path))


def spot_file(path, spot):
    """marmor's penumbra, a smooth step in the cosine, as the picture that Mitsuba's spot throws: it spans the tangent of half of the cone."""
    n, half = 1024, np.radians(spot["cone"] / 2)
    x, y = np.meshgrid((np.arange(n) + 0.5) / n * 2 - 1, (np.arange(n) + 0.5) / n * 2 - 1)
    cosine = 1 / np.sqrt(1 + (x * x + y * y) * np.tan(half) ** 2)
    inner = np.cos(half * (1 - spot["penumbra"]))
    t = np.clip((cosine - np.cos(half)) / (inner - np.cos(half)), 0, 1)
    mi.Bitmap(np.repeat((t * t * (3 - 2 * t))[..., None], 3, 2).astype(np.float32)).write(str(path))


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
    for image in {m["image"] for _, m, _ in scene["objects"] if "image" in m}:
        pixels = scenes.PICTURES[image]
        mi.Bitmap((255 * pixels).astype(np.uint8) if image.endswith(".png") else pixels.astype(np.float32)).write(str(folder / image))
    for i, light in enumerate(scene["lights"]):
        if light.get("penumbra"):
            spot_file(folder / f"spot{i}.exr", light)


def toml(value):
    return f'"{value}"' if isinstance(value, str) else str(value)


def marmor_file(scene, folder, size):
    position, look_at, fov = scene["camera"]
    out = ['unit = "mm"', "[camera]", f"position = {list(position)}", f"look_at = {list(look_at)}", f"resolution = {[size, size]}"]
    out += [f"{k} = {toml(v)}" for k, v in (({} if "height" in scene["optics"] else {"fov": fov}) | scene["optics"]).items()]
    for i, (_, m, _) in enumerate(scene["objects"]):
        out += ["[[object]]", f'mesh = "{i}.obj"', 'normals = "geometric"', f'material = "m{i}"']
        kind = {"medium": "translucent", "clear": "dielectric"}.get(m["kind"], m["kind"])
        if "priority" in m:
            out.append(f"priority = {m['priority']}")
        out += [f"[material.m{i}]", f'type = "{kind}"'] + [f"{k} = {v}" for k, v in m.items() if k not in ("kind", "priority", "image", "wrap", "ours")]
        if "image" in m:
            out.append(f'albedo = {{ image = "{m["image"]}", wrap = "{m["wrap"]}" }}')
    for light in scene["lights"]:
        out += ["[[light]]"] + [f"{k} = {toml(v)}" for k, v in light.items()]
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


def fresnel(mu, eta):
    """Reflectance of a boundary to an index eta times as high."""
    square = 1 - (1 - mu * mu) / eta**2
    t = np.sqrt(np.maximum(square, 0))
    return np.where(square < 0, 1.0, 0.5 * (((mu - eta * t) / (mu + eta * t)) ** 2 + ((eta * mu - t) / (eta * mu + t)) ** 2))


def mean_inside_off(eta, rough):
    """What Mitsuba's plastic has its body too bright by. It divides by 1 - R, R being the mean reflectance from inside: of a smooth coat by
    a fit, of a rough one by a mean over 64 places whose ends have the weight of the others (here of a smooth one: right for alpha 0.01)."""
    mean = lambda mu: float((2 * mu * fresnel(mu, 1 / eta)).mean())
    r = 1 / eta
    theirs = mean(np.linspace(1e-6, 1, 64)) if rough else -1.4399 * r * r + 0.7099 * r + 0.6681 + 0.0636 / r
    return (1 - mean((np.arange(100000) + 0.5) / 100000)) / (1 - theirs)


def surface(m, folder):
    width = {"alpha": m["roughness"] ** 2} if m.get("roughness") else {}
    alpha = {"distribution": "ggx", **width} if width else {}
    if m["kind"] == "diffuse" and m.get("roughness"):
        return {"type": "oren_nayar", "body": m["albedo"], "roughness": m["roughness"]}
    if m.get("ours"):
        return {"type": "rough_plastic", "body": m["albedo"], "eta": m["eta"], **width}
    if m["kind"] == "conductor" and alpha:
        return {"type": "rough_metal", "n": m["n"], "k": m["k"], **width}
    if m["kind"] == "conductor":
        index = {"eta": spectrum(m["n"]), "k": spectrum(m["k"])} if "n" in m else {"material": "none"}
        return {"type": "conductor", **index}
    if m["kind"] == "plastic":
        body = np.array(m["albedo"]) / mean_inside_off(m["eta"], bool(alpha))
        return {"type": "roughplastic" if alpha else "plastic", "int_ior": m["eta"], "ext_ior": 1.0, "diffuse_reflectance": spectrum(body), **alpha}
    if "image" in m:
        linear = m["image"].endswith(".exr")
        return {"type": "diffuse", "reflectance": {"type": "bitmap", "filename": str(folder / m["image"]), "raw": linear, "filter_type": "bilinear", "wrap_mode": m["wrap"], "format": "variant"}}
    return {"type": "diffuse", "reflectance": spectrum(m["albedo"])}


def opaque(m, folder):
    if m["kind"] != "emissive":
        return {"bsdf": {"type": "twosided", "bsdf": surface(m, folder)}}
    return {"bsdf": {"type": "diffuse", "reflectance": spectrum([0, 0, 0])}, "emitter": {"type": "area", "radiance": spectrum(m["radiance"])}}


def light(source, place, sky, folder):
    """`sky`: radiance of an even one, which a sun stands before and adds to."""
    kind, look_at = source["type"], mi.ScalarTransform4f().look_at
    if kind == "distant":
        return {"type": "directional", "direction": source["direction"], "irradiance": spectrum(source["irradiance"])}
    if kind == "point":
        return {"type": "point", "position": source["position"], "intensity": spectrum(source["intensity"])}
    if kind == "spot":
        half, to_world = source["cone"] / 2, look_at(origin=source["position"], target=source["look_at"], up=[0, 1, 0])
        out = {"type": "spot", "to_world": to_world, "intensity": spectrum(source["intensity"]), "cutoff_angle": half, "beam_width": half * (1 - 1e-5)}
        if source["penumbra"]:
            out["texture"] = {"type": "bitmap", "filename": str(folder / f"spot{place}.exr"), "raw": True, "wrap_mode": "clamp", "format": "variant"}
        return out
    half, towards = np.radians(source["angle"] / 2), -np.array(source["direction"]) / np.linalg.norm(source["direction"])
    across = mi.ScalarTransform4f().scale([SUN_DISTANCE * np.tan(half)] * 3)
    radiance = np.array(source["irradiance"]) / (np.pi * np.sin(half) ** 2) + sky
    return {"type": "disk", "to_world": look_at(origin=list(SUN_DISTANCE * towards), target=[0, 0, 0], up=[0, 0.6, 0.8]) @ across,
            "bsdf": {"type": "diffuse", "reflectance": spectrum([0, 0, 0])}, "emitter": {"type": "area", "radiance": spectrum(radiance)}}


def camera(scene, size):
    (position, look_at, fov), optics = scene["camera"], scene["optics"]
    to_world = mi.ScalarTransform4f().look_at(origin=list(position), target=list(look_at), up=[0, 1, 0])
    out = {"type": "perspective", "fov": fov, "fov_axis": "y", "near_clip": 1e-3, "far_clip": 1e4}
    if any(light["type"] == "sun" for light in scene["lights"]):
        out |= {"near_clip": 1e-2, "far_clip": 2 * SUN_DISTANCE}
    if "height" in optics:
        out = {k: v for k, v in out.items() if not k.startswith("fov")} | {"type": "orthographic"}
        to_world = to_world @ mi.ScalarTransform4f().scale([optics["height"] / 2, optics["height"] / 2, 1])
    if "aperture" in optics:
        focus = optics.get("focus", float(np.linalg.norm(np.subtract(look_at, position))))
        out |= {"type": "thinlens", "aperture_radius": optics["aperture"] / 2, "focus_distance": focus}
    if "shift" in optics:
        out |= {"principal_point_offset_x": optics["shift"][0], "principal_point_offset_y": -optics["shift"][1]}
    return dict(out, to_world=to_world, sampler={"type": "independent"},
                film={"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"})


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
    sensor = camera(scene, size)
    out = {"type": "scene", "sensor": sensor}
    for i, name in medium_ref.items():
        out[name] = dict(media[i], id=name)
    if scene["inside"] is not None:
        sensor["medium"] = {"type": "ref", "id": medium_ref[scene["inside"]]}
    faces = scene["faces"] or [(None, i if bodies[i] else m, around) for i, (_, m, around) in enumerate(objects)]
    for i, (mesh, inside, around) in enumerate(faces):
        shape = {"type": "obj", "filename": str(folder / f"{'face' if mesh else ''}{i}.obj"), "face_normals": True}
        if not isinstance(inside, int):
            out[f"object{i}"] = dict(shape, **opaque(inside, folder))
            continue
        eta, outside = objects[inside][1]["eta"], 1.0 if around is None else objects[around][1]["eta"]
        rough = {"type": "roughdielectric", "distribution": "ggx", "alpha": objects[inside][1].get("roughness", 0.0) ** 2}
        boundary = rough if rough["alpha"] else {"type": "dielectric"}
        shape["bsdf"] = {"type": "null"} if eta == outside else boundary | {"int_ior": eta, "ext_ior": outside}
        for side, body in (("interior", inside), ("exterior", around)):
            if body in medium_ref:
                shape[side] = {"type": "ref", "id": medium_ref[body]}
        out[f"object{i}"] = shape
    if callable(scene["sky"]):
        out["sky"] = {"type": "envmap", "filename": str(folder / "sky_mitsuba.exr")}
    elif scene["sky"] is not None:
        out["sky"] = {"type": "constant", "radiance": spectrum([scene["sky"]] * 3)}
    for i, source in enumerate(scene["lights"]):
        out[f"light{i}"] = light(source, i, scene["sky"] if isinstance(scene["sky"], float) else 0.0, folder)
    plain = {"type": "path", "max_depth": -1 if scene["bounces"] is None else scene["bounces"] + 2}
    volume = dict(SETTINGS[setting], max_depth=-1)
    out["integrator"] = integrator or (volume if medium_ref else plain)
    return out
