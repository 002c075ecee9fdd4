"""Four deviations at octave averaging times with allantools 2024.6, timed; the least of five runs each.

usage: python allan.py FILE RATE_HZ, FILE of little-endian doubles. Prints "seconds S", then "name factor value" lines.
Packages: requirements.txt beside it.
"""

import sys
import time

try:
    import allantools
    import numpy
except ImportError as missing:
    sys.exit(print(f"skipped: {missing}"))

rate_hz = float(sys.argv[2])
values = numpy.fromfile(sys.argv[1], dtype="<f8")
runs = 5 if values.size < 1_000_000 else 1
names = {"oadev": allantools.oadev, "mdev": allantools.mdev, "tdev": allantools.tdev, "hdev": allantools.ohdev}
seconds, lines = 0.0, []
for name, deviation in names.items():
    least = float("inf")
    for _ in range(runs):
        start = time.perf_counter()
        taus, found, _, _ = deviation(values, rate=rate_hz, data_type="freq", taus="octave")
        least = min(least, time.perf_counter() - start)
    seconds += least
    lines += [f"{name} {round(tau * rate_hz)} {value!r}" for tau, value in zip(taus.tolist(), found.tolist())]
print("seconds", seconds)
print("\n".join(lines))
