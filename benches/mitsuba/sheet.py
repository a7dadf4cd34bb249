"""All pictures of render.py on one sheet, marmor above Mitsuba: sheet.py DIR SHEET.png [--seed N] [--zoom 2]."""

import argparse
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
import scenes

a = argparse.ArgumentParser()
a.add_argument("out", type=Path)
a.add_argument("sheet")
a.add_argument("--seed", type=int, default=0)
a.add_argument("--zoom", type=int, default=2)
a.add_argument("--columns", type=int, default=13)
args = a.parse_args()
pairs = []
for name in scenes.SCENES:
    files = [args.out / name / f"{run}-{args.seed}.npz" for run in ("marmor", "mitsuba")]
    if all(f.exists() for f in files):
        both = [np.load(f)["pictures"].mean(0) for f in files]
        bright = max(np.quantile(both[1], 0.97), 1e-6)
        pairs.append(np.concatenate([np.pad(p / bright, ((1, 1), (1, 1), (0, 0))) for p in both]))
while len(pairs) % args.columns:
    pairs.append(np.zeros_like(pairs[0]))
rows = [np.concatenate(pairs[i : i + args.columns], axis=1) for i in range(0, len(pairs), args.columns)]
picture = np.clip(np.concatenate(rows), 0, 1) ** (1 / 2.2)
picture = picture.repeat(args.zoom, 0).repeat(args.zoom, 1)
mi.Bitmap((255 * picture + 0.5).astype(np.uint8)).write(args.sheet)
