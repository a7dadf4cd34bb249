"""Renders the scenes by both programs, each in independent parts, and keeps the parts.

    python3 -m venv VENV && VENV/bin/pip install mitsuba numpy scipy       # Mitsuba 3.9
    apt install libllvm19                                                  # for its variant llvm_ad_rgb; 14 and 15 stop with "Cannot select"
    export DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM-19.so
    cargo build --release --features embree
    VENV/bin/python benches/mitsuba/render.py -o DIR [NAMES] [--seconds 12] [--models] [--settings] [--seed 0]
    VENV/bin/python benches/mitsuba/judge.py DIR             # the tables of docs/against-mitsuba.md
    VENV/bin/python benches/mitsuba/sheet.py DIR sheet.png   # all pictures, marmor above Mitsuba

`--seconds` is user CPU for each program and scene; `--models` adds `subsurface` by the default model and by `beam`, `--settings`
other settings of Mitsuba, each for a quarter of the time; `--threads` are marmor's, `--program` is another marmor;
`--seed` makes other numbers, so that a block can be judged twice. All times are user CPU seconds, which other work on
the machine changes little. A second or so of start is no part of them: what a render of 1 sample takes is taken off. Mitsuba wants two CPUs: with one it
(its thread pool then has no thread) waits for ever.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

SIZE, PARTS = 48, 16


def user_seconds(who):
    return resource.getrusage(who).ru_utime


class Marmor:
    program, threads = Path(__file__).parents[2] / "target/release/marmor", 2

    def __init__(self, scene, folder, options=()):
        import write
        self.file, self.options = write.marmor_file(scene, folder, SIZE), options

    def render(self, spp, seed):
        with tempfile.TemporaryDirectory() as d:
            before = user_seconds(resource.RUSAGE_CHILDREN)
            subprocess.run([self.program, "render", self.file, "-q", "--threads", str(self.threads), "--spp", str(spp), "-D", f"render.seed={seed}", "-o", f"{d}/a.exr", *self.options],
                           check=True, stderr=subprocess.DEVNULL)
            return np.array(mi.Bitmap(f"{d}/a.exr").convert(mi.Bitmap.PixelFormat.RGB)), user_seconds(resource.RUSAGE_CHILDREN) - before


class Mitsuba:
    def __init__(self, scene, folder, setting):
        import write
        # Of a camera in a body marmor has radiance over eta squared.
        self.factor = 1.0 if scene["inside"] is None else scene["objects"][scene["inside"]][1]["eta"] ** -2
        self.scene = mi.load_dict(write.mitsuba_scene(scene, folder, SIZE, setting))

    def render(self, spp, seed):
        before = user_seconds(resource.RUSAGE_SELF)
        return self.factor * np.array(mi.render(self.scene, spp=spp, seed=seed)), user_seconds(resource.RUSAGE_SELF) - before


def parts(program, seconds, seed, count=PARTS):
    """{pictures, spp of each, seconds of a sample of each pixel}"""
    warm = lambda spp: min([program.render(spp, seed + 900 + i)[1] for i in range(3)][1:])  # the first of a count compiles
    start, few = warm(1), 5
    while (took := warm(few) - start) < 0.1 and few < 2000:
        few *= 5
    spp = int(np.clip(seconds / count / max(took / (few - 1), 1e-7), 2, 16384))
    program.render(spp, seed + 999)
    done = [program.render(spp, seed + i) for i in range(count)]
    per_sample = max(np.mean([t for _, t in done]) - start, 1e-4) / (spp - 1)
    return {"pictures": np.array([p for p, _ in done], np.float32), "spp": spp, "seconds": per_sample, "start": start}


def body_mask(scene, folder):
    """The pixels through whose middle the camera sees a translucent body first."""
    import write
    loaded = mi.load_dict(write.mitsuba_scene(scene, folder, SIZE), optimize=False)
    x, y = np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5)
    place = mi.Point2f(mi.Float(np.ravel(x / SIZE)), mi.Float(np.ravel(y / SIZE)))
    ray, _ = loaded.sensors()[0].sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
    met = loaded.ray_intersect(ray).shape
    bodies = [s for s in loaded.shapes() if s.id().startswith("object") and scene["objects"][int(s.id().removeprefix("object"))][1]["kind"] == "medium"]
    return sum(np.array(met == mi.ShapePtr(s)) for s in bodies).reshape(SIZE, SIZE) > 0


def main():
    a = argparse.ArgumentParser()
    a.add_argument("names", nargs="*")
    a.add_argument("-o", "--out", type=Path, required=True)
    a.add_argument("--seconds", type=float, default=12)
    a.add_argument("--seed", type=int, default=0)
    a.add_argument("--models", action="store_true")
    a.add_argument("--settings", action="store_true")
    a.add_argument("--also", help="RUN,OPTION,.. : marmor once more with options, kept as RUN and nothing else; for judge.py --ours RUN")
    a.add_argument("--variant", default="llvm_ad_rgb")
    a.add_argument("--threads", type=int, default=2)
    a.add_argument("--program", type=Path, default=Marmor.program, help="marmor")
    args = a.parse_args()
    mi.set_variant(args.variant)
    Marmor.program, Marmor.threads = args.program, args.threads
    import scenes
    import surfaces
    import write
    surfaces.register()
    for name in args.names or scenes.SCENES:
        scene, folder = scenes.SCENES[name], args.out / name
        write.meshes(scene, folder)
        runs = {"marmor": lambda: Marmor(scene, folder), "mitsuba": lambda: Mitsuba(scene, folder, "mitsuba")}
        if args.models and any(m["kind"] == "medium" for _, m, _ in scene["objects"]) and not scene["faces"]:
            runs["standard"] = lambda: Marmor(scene, folder, ["--method", "subsurface"])
            runs["beam"] = lambda: Marmor(scene, folder, ["--method", "subsurface", "--model", "beam"])
        if args.also:
            run, *options = args.also.split(",")
            runs = {run: lambda: Marmor(scene, folder, options)}
        if args.settings and any(write.mitsuba_medium(m) for _, m, _ in scene["objects"] if m["kind"] in ("medium", "clear")):
            runs |= {s: lambda s=s: Mitsuba(scene, folder, s) for s in write.SETTINGS if s != "mitsuba"}
        for run, program in runs.items():
            target = folder / f"{run}-{args.seed}.npz"
            if target.exists():
                continue
            try:
                whole = run in ("marmor", "mitsuba") or args.also
                out = parts(program(), args.seconds / (1 if whole else 4), args.seed, 5 if run in ("standard", "beam") else PARTS)
            except Exception as e:  # one refused scene must not end the others
                print(name, run, "failed:", e, file=sys.stderr)
                continue
            if run == "beam":
                np.save(folder / "mask.npy", body_mask(scene, folder))
            np.savez_compressed(target, **out)
            print(name, run, "spp", out["spp"], "ms/sample", round(1e3 * out["seconds"], 3), "mean", out["pictures"].mean((0, 1, 2)), flush=True)


main()
