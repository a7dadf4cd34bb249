"""The tables of docs/against-mitsuba.md from what render.py has kept: judge.py DIR [--seed N].

A block is 8x8 pixels of one channel. From the means of its parts: the difference, its standard error, Welch's degrees of
freedom, the probability under Student's law, and the z of a normal law that has the same probability. The bound is that of
the whole table (Sidak). A block is *speckled* if one part has more than 60 % of the squared deviations of either program's
parts: its error is that of one bright sample, and Student's law says nothing of it.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy import stats

import scenes

BLOCK = 8
SETTINGS = ("mitsuba-roulette", "mitsuba-plain", "mitsuba-plain-roulette")


def blocks(pictures):
    """(parts, h, w, 3) -> (parts, blocks * 3)"""
    n, h, w, c = pictures.shape
    means = pictures.astype(np.float64).reshape(n, h // BLOCK, BLOCK, w // BLOCK, BLOCK, c).mean((2, 4))
    return means.reshape(n, -1)


def speckled(parts):
    d = (parts - parts.mean(0)) ** 2
    return d.max(0) > 0.6 * np.maximum(d.sum(0), 1e-300)


def z_of(a, b):
    """z by block, and which have a spread at all (panels seen full face have none)."""
    va, vb = a.var(0, ddof=1) / len(a), b.var(0, ddof=1) / len(b)
    rounding = (2e-6 * (a.mean(0) + b.mean(0)) / 2) ** 2  # of sums in f32
    se = np.sqrt(va + vb + rounding)
    df = (va + vb) ** 2 / np.maximum(va**2 / (len(a) - 1) + vb**2 / (len(b) - 1), 1e-300)
    difference, lit = a.mean(0) - b.mean(0), (a.mean(0) + b.mean(0)) > 0
    t = np.where(lit, difference / np.where(se > 0, se, 1), 0)
    p = np.maximum(stats.t.logsf(np.abs(t), np.where(va + vb > 0, np.maximum(df, 1), 1e3)), -700)
    return np.sign(t) * -stats.norm.ppf(np.exp(p)), lit


def rel_mse(run, other):
    """Of one part, against the mean of the other program's, whose own variance is taken off."""
    r = other["pictures"].astype(np.float64)
    mean, variance = r.mean(0), r.var(0, ddof=1) / len(r)
    error = ((run["pictures"] - mean) ** 2).mean(0) - variance
    return (error / (mean**2 + 0.01 * mean.mean() ** 2)).mean()


def own_variance(run, other):
    mean = other["pictures"].astype(np.float64).mean(0)
    return (run["pictures"].astype(np.float64).var(0, ddof=1) / (mean**2 + 0.01 * mean.mean() ** 2)).mean()


def too_short(run):
    """Whether a part took less than a quarter of the start that is taken off: its seconds are then no measurement."""
    return run["seconds"] * run["spp"] < run["start"] / 4


def ratio(a, b):
    """mean(a) / mean(b) over the picture by channel, with its standard error."""
    x, y = a.mean((1, 2), dtype=np.float64), b.mean((1, 2), dtype=np.float64)
    error = np.sqrt(x.var(0, ddof=1) / len(x) / x.mean(0) ** 2 + y.var(0, ddof=1) / len(y) / y.mean(0) ** 2)
    return x.mean(0) / y.mean(0), error


def percent(values, errors):
    return ", ".join(f"{100 * (v - 1):+.2f} ± {100 * e:.2f}" for v, e in zip(values, errors))


def load(folder, run, seed):
    file = folder / f"{run}-{seed}.npz"
    return dict(np.load(file)) if file.exists() else None


def agreement(out, seed, ours):
    rows, every = [], []
    for name, scene in scenes.SCENES.items():
        m, o = load(out / name, ours, seed), load(out / name, "mitsuba", seed)
        if m is None or o is None:
            continue
        a, b = blocks(m["pictures"]), blocks(o["pictures"])
        z, lit = z_of(a, b)
        rows.append((name, scene, m, o, z[lit], (speckled(a) | speckled(b))[lit]))
        every.append(z[lit])
    bound = stats.norm.isf((1 - 0.95 ** (1 / sum(map(len, every)))) / 2)
    print(f"{len(rows)} scenes, {sum(map(len, every))} blocks, bound {bound:.2f}\n")
    print("| scene | tries | method | worst z | rms z | within | speckled | mean difference in % | CPU s to 1e-2, marmor | Mitsuba | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    beyond, means = 0, []
    for name, scene, m, o, z, s in rows:
        beyond += (np.abs(z) > bound).sum()
        settings = [o] + [run for s in SETTINGS if (run := load(out / name, s, seed)) and np.abs(ratio(run["pictures"], o["pictures"])[0] - 1).max() < 0.02]
        cost = [min(run["seconds"] * run["spp"] * rel_mse(run, other) / 1e-2 for run in runs) for runs, other in (([m], o), (settings, m))]
        check = [rel_mse(run, other) / own_variance(run, other) for run, other in ((m, o), (o, m))]
        of_mean, error = ratio(m["pictures"], o["pictures"])
        means.append((of_mean - 1) / error)
        odd = " (!)" if max(abs(np.array(check) - 1)) > 0.2 else ""
        seconds = f"{cost[0]:.3g} | {cost[1]:.3g} | {cost[1] / cost[0]:.2g}{odd}"
        if too_short(m) or too_short(o):
            seconds = " | ".join(["–" if too_short(run) else f"{c:.3g}" for run, c in ((m, cost[0]), (o, cost[1]))] + ["–"])
        print(f"| {name} | {scene['tries']} | {scene['method']} | {z[np.argmax(np.abs(z))]:.1f} | {np.sqrt((z**2).mean()):.2f} | {100 * (np.abs(z) <= bound).mean():.2f} % ({len(z)}) | {s.sum()} "
              f"| {percent(of_mean, error)} | {seconds} |")
    z = np.concatenate(every)
    print(f"\nall: beyond the bound {beyond} of {len(z)}, within {100 * (1 - beyond / len(z)):.3f} %; beyond 3: {100 * (np.abs(z) > 3).mean():.2f} %; mean z {z.mean():.3f}, rms {np.sqrt((z**2).mean()):.3f}")
    means, calm = np.array(means), ~np.concatenate([s for *_, s in rows])
    print(f"without the {(~calm).sum()} speckled: beyond the bound {(np.abs(z[calm]) > bound).sum()}, beyond 3: {100 * (np.abs(z[calm]) > 3).mean():.2f} %, rms {np.sqrt((z[calm]**2).mean()):.3f}")
    print(f"mean differences in their standard errors: rms {np.sqrt((means**2).mean()):.2f}, largest {np.abs(means).max():.1f}")


def bias(out, seed):
    """Of blocks at least half of which is a translucent body: against both truths together, weighted by their variances."""
    print("\n| scene | model | mean difference in % (R, G, B) | against Mitsuba alone | rms of blocks in % | of that noise |")
    print("|---|---|---|---|---|---|")
    for name in scenes.SCENES:
        for model in ("standard", "beam"):
            s, m, o = [load(out / name, run, seed) for run in (model, "marmor", "mitsuba")]
            if s is None or m is None or o is None:
                continue
            mask = np.load(out / name / "mask.npy")
            h, w = mask.shape
            on = mask.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK).mean((1, 3)) >= 0.5
            if not on.any():
                continue
            pick = lambda run: blocks(run["pictures"]).reshape(len(run["pictures"]), -1, 3)[:, on.ravel()]
            s, m, o = pick(s), pick(m), pick(o)
            variance = lambda x: x.var(0, ddof=1) / len(x)
            weight = lambda x: 1 / variance(x.mean((1, 2))[:, None])[0]
            truth = (weight(m) * m.mean(0) + weight(o) * o.mean(0)) / (weight(m) + weight(o))
            noise = variance(s) + (weight(m) ** 2 * variance(m) + weight(o) ** 2 * variance(o)) / (weight(m) + weight(o)) ** 2
            total = lambda x: x.mean(1)
            t_var = 1 / (1 / variance(total(m)) + 1 / variance(total(o)))
            mean = total(s).mean(0) / truth.mean(0)
            error = np.sqrt(variance(total(s)) + t_var) / truth.mean(0)
            alone = total(s).mean(0) / total(o).mean(0)
            alone_error = np.sqrt(variance(total(s)) + variance(total(o))) / truth.mean(0)
            relative = ((s.mean(0) - truth) / truth.mean(0)) ** 2
            spread = np.sqrt(max(relative.mean() - (noise / truth.mean(0) ** 2).mean(), 0))
            print(f"| {name} | {model} | {percent(mean, error)} | {percent(alone, alone_error)} | {100 * spread:.1f} | {100 * np.sqrt((noise / truth.mean(0) ** 2).mean()):.1f} |")


a = argparse.ArgumentParser()
a.add_argument("out", type=Path)
a.add_argument("--seed", type=int, default=0)
a.add_argument("--ours", default="marmor")
args = a.parse_args()
agreement(args.out, args.seed, args.ours)
if args.ours == "marmor":
    bias(args.out, args.seed)
