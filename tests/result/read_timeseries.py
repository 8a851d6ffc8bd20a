"""Reads a timeseries.h5 of sample_series(3000) as a user would. Exit status 77: h5py is not installed."""
import sys

try:
    import h5py
    import numpy as np
except ImportError as error:
    print(error)
    sys.exit(77)

with h5py.File(sys.argv[1], "r") as file:
    assert file.attrs["schema"] == "grapnel-timeseries/1", dict(file.attrs)
    assert file.attrs["version"] == "0.1.0"
    assert file.attrs["scenario"] == "sample"
    assert file.attrs["sha256"] == "0123456789abcdef"

    time, phase = file["time"], file["phase"]
    assert time.shape == (3000,) and time.dtype == np.float64 and time.attrs["unit"] == "s"
    assert np.array_equal(time[:], [0.1 * i for i in range(3000)])
    assert phase.dtype == np.int32 and list(phase.attrs["names"]) == ["approach", "post_impact"]
    assert set(phase[:1500]) == {0} and set(phase[1500:]) == {1}

    position = file["base/position"]
    assert position.shape == (3000, 3) and position.attrs["unit"] == "m"
    assert list(position.attrs["components"]) == ["x", "y", "z"]
    assert position.attrs["description"] == "what base/position is"
    assert position.compression == "gzip" and position.shuffle
    assert np.isnan(position[0, 0]) and np.isposinf(position[0, 1]) and np.isneginf(position[0, 2])
    assert np.all(np.isfinite(position[1:]))

    energy = file["kinetic_energy"]
    assert energy.shape == (3000,) and energy.attrs["unit"] == "J"
    assert energy.attrs["description"] == "½ νᵀ M ν"
    assert list(file["joints/position"].attrs["components"]) == ["left-1", 'right, "1"']
    assert file["info/end"].attrs["unit"] == "N·m"

    datasets = []
    file.visititems(lambda name, item: datasets.append(name) if isinstance(item, h5py.Dataset) else None)
    assert len(datasets) == 9, datasets
    for name in datasets:
        assert {"unit", "description"} <= set(file[name].attrs), name
