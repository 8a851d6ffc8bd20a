"""Reads a timeseries.mat of sample_series(n) as SciPy's users would. Exit status 77: SciPy is not installed."""
import sys

try:
    import numpy as np
    import scipy.io
except ImportError as error:
    print(error)
    sys.exit(77)

n = int(sys.argv[2])
data = scipy.io.loadmat(sys.argv[1], simplify_cells=True)["grapnel"]
assert data["schema"] == "grapnel-timeseries/1" and data["version"] == "0.1.0", data
assert data["scenario"] == "sample" and data["sha256"] == "0123456789abcdef"
assert list(data["phase_names"]) == ["approach", "post_impact"]
assert np.array_equal(np.atleast_1d(data["time"]), [0.1 * i for i in range(n)])
assert np.size(data["base"]["position"]) == 3 * n
info = data["info"]
assert info["base"]["position"]["unit"] == "m"
assert list(info["base"]["position"]["components"]) == ["x", "y", "z"]
assert info["base"]["position"]["path"] == "base/position"
assert info["kinetic_energy"]["description"] == "½ νᵀ M ν", info["kinetic_energy"]
assert info["info"]["xend"]["unit"] == "N·m"
names = dict(zip(data["names"]["path"], data["names"]["matlab"]))
assert names["base/position"] == "base.position"
assert names["end_effectors/left-hand/velocity"] == "end_effectors.left_hand.velocity"
assert names["end_effectors/left_hand/velocity"] == "end_effectors.left_hand_2.velocity"
assert names["info/end"] == "info_2.xend"
