"""The part of gymnasium that grapnel.env uses, with the signatures of version 1.0, for tests: Debian has no package of it."""

from __future__ import annotations

import numpy as np

from . import spaces

__all__ = ["Env", "spaces"]


class Env:
    metadata = {"render_modes": []}
    render_mode = None
    spec = None
    action_space: spaces.Space
    observation_space: spaces.Space
    _np_random = None
    _np_random_seed = None

    def step(self, action):
        raise NotImplementedError

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        if seed is not None:
            self._np_random, self._np_random_seed = np.random.default_rng(seed), seed

    def render(self):
        raise NotImplementedError

    def close(self):
        pass

    @property
    def unwrapped(self):
        return self

    @property
    def np_random(self):
        if self._np_random is None:
            self._np_random = np.random.default_rng()
        return self._np_random

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
        return False
