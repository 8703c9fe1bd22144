"""What the peers share, with nothing but numpy: the arrays of a problem (peers.py), the active set, the loop over the
steps, and the answer. A peer says how it numbers unknowns, assembles and solves."""

import json
import sys
import time

import numpy as np

# Relative accuracy of the signs of pressures and gaps.
SIGN = 1e-10


class Problem:
    """The problem of the command line's FILE; unknowns are numbered as `place` says, per unknown 2·node + axis."""

    def __init__(self, place=lambda points, unknowns: unknowns):
        self.arrays = np.load(sys.argv[1])
        self.points, self.triangles, self.sign = (self.arrays[key] for key in ("points", "triangles", "sign"))
        self.lame, self.mu = self.arrays["lame"]
        (self.diffusion, self.lambda_d, self.lambda_u, self.lambda_w, self.strain_cap, self.threshold,
         self.step) = self.arrays["damage"]
        place_of = lambda unknowns: place(self.points, unknowns)
        self.unknowns = place_of(np.arange(2 * len(self.points)))
        self.fixed, self.contact, self.loaded = (place_of(self.arrays[key]) for key in ("fixed", "contact", "loaded"))
        self.active = np.ones(len(self.contact), bool)

    def active_set(self, x, f, gap, solve):
        """u with K u = f outside of the fixed and active unknowns, by a primal-dual active set. From a guess, f and
        these unknowns, whose values are prescribed, `solve` returns u and K u − f."""
        while True:
            x[self.fixed], x[self.contact[self.active]] = 0.0, (self.sign * gap)[self.active]
            x, residual = solve(x, f, np.concatenate((self.fixed, self.contact[self.active])))
            pressure, excess = -self.sign * residual[self.contact], self.sign * x[self.contact] - gap
            pulled, apart = pressure < -SIGN * np.abs(residual).max(), excess <= SIGN * np.abs(x).max()
            following = np.where(self.active, ~pulled, ~apart)
            if (following == self.active).all():
                return x
            self.active = following

    def run(self, program, damage, assemble, contact):
        """Makes all steps and prints the answer: `damage` returns ζ from the last u and ζ and the rate of φ without
        strains, `assemble` makes K for η, and `contact` returns u from a guess, f and the gaps."""
        x, f, zeta = np.zeros((3, len(self.unknowns)))
        before, zeta, seconds = x, np.ones(len(self.points)), []
        for n, (load, gap) in enumerate(zip(self.arrays["load"], self.arrays["gap"])):
            started = time.perf_counter()
            if n:
                zeta = damage(x, zeta, self.lambda_d * (1.0 / eta - 1.0) - self.lambda_w)
            eta = np.clip(zeta, self.threshold, 1.0)
            assemble(eta)
            assembled, f[self.loaded] = time.perf_counter(), load
            # The guess is the linear extrapolation of the last two states.
            x, before = contact(2.0 * x - before, f, gap), x
            seconds.append(time.perf_counter() - started)
            if not n:
                solve = time.perf_counter() - assembled
        print(json.dumps({
            "program": program, "seconds": seconds, "solve": solve, "zeta_min": float(zeta.min()), "work": float(f @ x),
            "displacement_max": float(np.hypot(*x[self.unknowns].reshape(-1, 2).T).max()), "steps": len(seconds) - 1,
        }))
