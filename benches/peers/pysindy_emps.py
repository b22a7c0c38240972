"""Times PySINDy on the positioning system, the same file as `trueup gap` is given.

    python benches/peers/pysindy_emps.py emps/train.csv

It needs velocity and its derivative, which are taken by a smoothing filter; the friction library is what somebody
writes who suspects friction already.
"""

import sys
import time
import warnings

import numpy as np
import pysindy as ps
from scipy.signal import savgol_filter

warnings.filterwarnings("ignore")
data = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
step = float(np.median(np.diff(data["t_s"])))
q, u = data["q_meas_m"], data["u_control_V"]
v = savgol_filter(np.gradient(savgol_filter(q, 31, 3), step), 31, 3)
friction = ps.CustomLibrary(
    [lambda x: x, lambda x: np.sign(x), lambda x: x * np.abs(x)],
    [lambda x: x, lambda x: f"sign({x})", lambda x: f"{x}|{x}|"],
)
for name, library in [("powers", ps.PolynomialLibrary(degree=2)), ("friction", friction)]:
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        model = ps.SINDy(optimizer=ps.STLSQ(threshold=0.05), feature_library=library)
        model.fit(np.c_[q, v], t=step, u=u)
        times.append(time.perf_counter() - begin)
    print(f"{name}: {min(times):.2f} to {max(times):.2f} s, v' = {model.equations()[1]}")
