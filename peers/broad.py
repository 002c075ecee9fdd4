"""Attitude filters of others on the recordings of BROAD, each from its own package with its defaults.

In: a folder of recordings, and the step [rad/s] of their rates' codes, which were cut towards zero: half of it is put
back, as for ours (ground/attitude/src/replay.rs). Out, on standard output: CSV
`filter,recording,mode,total,heading,inclination` in degrees, scored as ground/logs/src/score.rs scores ours. Modes:
full (285.7 Hz), five (5 Hz, each period's rotation composed of the samples' and given as a rate, three samples of force
turned to its end, one of the field: what ours is given), single (the same with one sample of force) and motion (begun
10 s into the motion). Mode speed has updates a second in one thread in place of the total error, the most of five runs.
Packages: `python3 -m venv peers/.venv && peers/.venv/bin/pip install -r peers/requirements.txt`.
"""

import functools
import gzip
import multiprocessing
import pathlib
import sys
import time

try:
    import ahrs
    import imufusion
    import numpy as np
    import vqf
except ImportError as missing:
    print(f"no peers: {missing}; see peers/requirements.txt", file=sys.stderr)
    sys.exit(3)

G = 9.81
FIVE_HZ = 57


def multiply(a, b):
    aw, ax, ay, az = a.T
    bw, bx, by, bz = b.T
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=1,
    )


def run_vqf(kind, dt, gyr, acc, mag):
    found = kind(dt).updateBatch(*(np.ascontiguousarray(x) for x in (gyr, acc, mag)))
    return found["quat9D"]


def run_imufusion(dt, gyr, acc, mag):
    fusion = imufusion.Ahrs()
    settings = imufusion.AhrsSettings()
    # The constructor passes over the convention.
    settings.convention = imufusion.CONVENTION_ENU
    settings.sample_rate = 1 / dt
    fusion.set_settings(settings)
    out = np.empty((len(gyr), 4))
    for k, (w, f, m) in enumerate(zip(np.degrees(gyr), acc / G, mag)):
        fusion.update(w, f, m)
        out[k] = np.asarray(fusion.get_quaternion(), dtype=float).ravel()
    return out


# From north-west-up, whose x is magnetic north, to east-north-up.
NORTH_WEST_UP = np.array([[np.sqrt(0.5), 0, 0, np.sqrt(0.5)]])


def start(acc, mag):
    """TRIAD to east-north-up from the first sample."""
    up = acc / np.linalg.norm(acc)
    east = np.cross(mag, up)
    east /= np.linalg.norm(east)
    return ahrs.Quaternion(dcm=np.stack([east, np.cross(up, east), up])).to_array()


def run_ahrs(kind, to_east_north_up, dt, gyr, acc, mag):
    """Of a filter whose frame is turned to east-north-up by a quaternion, or is that (`None`)."""
    filter_ = kind(Dt=dt)
    q = start(acc[0], mag[0])
    if to_east_north_up is not None:
        q = multiply(to_east_north_up * [1, -1, -1, -1], q[None])[0]
    out = np.empty((len(gyr), 4))
    for k in range(len(gyr)):
        q = filter_.updateMARG(q, gyr[k], acc[k], mag[k], dt=dt)
        out[k] = q
    if to_east_north_up is None:
        return out
    return multiply(np.repeat(to_east_north_up, len(out), axis=0), out)


def run_triad(dt, gyr, acc, mag):
    up = acc / np.linalg.norm(acc, axis=1, keepdims=True)
    east = np.cross(mag, up)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    matrices = np.stack([east, np.cross(up, east), up], axis=1)
    return np.array([ahrs.Quaternion(dcm=m).to_array() for m in matrices])


FILTERS = {
    "VQF": lambda *data: run_vqf(vqf.VQF, *data),
    "BasicVQF": lambda *data: run_vqf(vqf.BasicVQF, *data),
    "Madgwick": lambda *data: run_ahrs(ahrs.filters.Madgwick, NORTH_WEST_UP, *data),
    # Its reference field has no x: y is magnetic north.
    "Mahony": lambda *data: run_ahrs(ahrs.filters.Mahony, None, *data),
    "xio Fusion": run_imufusion,
    "TRIAD alone": run_triad,
}


def turned(rates, dt):
    """The rotation of each period, whose rates these are."""
    q = np.tile([1.0, 0.0, 0.0, 0.0], (len(rates), 1))
    for k in range(rates.shape[1]):
        half = rates[:, k] * dt / 2
        norm = np.linalg.norm(half, axis=1, keepdims=True)
        q = multiply(q, np.hstack([np.cos(norm), half * np.sinc(norm / np.pi)]))
    return q


def composed(rates, dt):
    """Rates that turn in one period of `dt * rates.shape[1]` by what these turn in it, sample by sample."""
    q = turned(rates, dt)
    norm = np.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    angle = 2 * np.arctan2(norm, q[:, :1])
    return q[:, 1:] * angle / np.maximum(norm, 1e-12) / (dt * rates.shape[1])


def mean_force(periods, dt):
    """Of three samples evenly through each period, turned to its end."""
    last = periods.shape[1] - 1
    force = periods[:, last, 4:7].copy()
    for at in (last // 3, last * 2 // 3):
        q = turned(periods[:, at + 1 :, 1:4], dt)
        sample = np.hstack([np.zeros((len(q), 1)), periods[:, at, 4:7]])
        force += multiply(multiply(q * [1, -1, -1, -1], sample), q)[:, 1:]
    return force / 3


def uncut(rates, step):
    """The middle of what a code stands for that was cut towards zero; zero itself is that already."""
    return rates + np.where(np.abs(rates) > step / 2, np.copysign(step / 2, rates), 0)


def modes(rows):
    dt = np.median(np.diff(rows[:, 0]))
    yield "full", dt, rows
    count = len(rows) // FIVE_HZ
    five = rows[: count * FIVE_HZ].reshape(count, FIVE_HZ, -1)
    last = five[:, -1].copy()
    last[:, 1:4] = composed(five[:, :, 1:4], dt)
    yield "single", dt * FIVE_HZ, last.copy()
    last[:, 4:7] = mean_force(five, dt)
    yield "five", dt * FIVE_HZ, last
    moving = np.argmax(rows[:, 17] > 0)
    yield "motion", dt, rows[np.searchsorted(rows[:, 0], rows[moving, 0] + 10) :]


def rmse(found, rows):
    scored = (rows[:, 17] > 0) & ~np.isnan(rows[:, 10])
    e = multiply(found, rows[:, 10:14] * [1, -1, -1, -1])[scored]
    w, x, y, z = np.abs(e.T)
    angles = (
        2 * np.arctan2(np.sqrt(x * x + y * y + z * z), w),
        2 * np.arctan2(z, w),
        2 * np.arctan2(np.hypot(x, y), np.hypot(w, z)),
    )
    return [np.degrees(np.sqrt(np.mean(angle**2))) for angle in angles]


def lines_of(cut_step, path):
    with gzip.open(path, "rt") as text:
        rows = np.genfromtxt(text, delimiter=",", skip_header=1)
    rows[:, 1:4] = uncut(rows[:, 1:4], cut_step)
    lines = []
    for mode, dt, part in modes(rows):
        for name, run in FILTERS.items():
            found = run(dt, part[:, 1:4], part[:, 4:7], part[:, 7:10])
            errors = ",".join(f"{error:.4f}" for error in rmse(found, part))
            lines.append(f"{name},{path.name[:2]},{mode},{errors}")
    return lines


def speed(path, runs=5):
    """Updates a second of VQF, which is C++ and takes the whole recording at once."""
    with gzip.open(path, "rt") as text:
        rows = np.genfromtxt(text, delimiter=",", skip_header=1)
    data = [np.ascontiguousarray(rows[:, first : first + 3]) for first in (1, 4, 7)]
    least = float("inf")
    for _ in range(runs):
        filter_ = vqf.VQF(np.median(np.diff(rows[:, 0])))
        begun = time.perf_counter()
        filter_.updateBatch(*data)
        least = min(least, time.perf_counter() - begun)
    return f"VQF,{path.name[:2]},speed,{len(rows) / least:.0f},,"


def main():
    print("filter,recording,mode,total,heading,inclination")
    paths = sorted(pathlib.Path(sys.argv[1]).glob("[0-9][0-9]*.csv.gz"))
    with multiprocessing.Pool() as pool:
        for done, found in enumerate(pool.imap(functools.partial(lines_of, float(sys.argv[2])), paths), start=1):
            print("\n".join(found), flush=True)
            print(f"peers: {done} of {len(paths)} recordings", file=sys.stderr)
    if paths:
        print(speed(paths[0]))


if __name__ == "__main__":
    main()
