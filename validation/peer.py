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
        self.two_step = bool(self.arrays["two_step"])
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
            if self.stays(pressure, excess, np.abs(residual).max(), np.abs(x).max()):
                return x

    def stays(self, pressure, excess, force, length):
        """Takes the next active set by the signs of the pressures and of the excesses over the gap, whose rounding is relative
        to `force` and `length`. True if the set stays as it is."""
        following = np.where(self.active, pressure >= -SIGN * force, excess > SIGN * length)
        same, self.active = (following == self.active).all(), following
        return same

    def damage_step(self, source, diffuse):
        """The damage step of `run` by the scheme of the scene: Euler's (28), or two-step differences with equal steps as in
        src/evolution/step_controller/mod.rs. `source` returns b from u and the rate of φ without strains, and `diffuse`
        returns (M + kκL)⁻¹ (M start + k b) from k, start and b."""
        past = None

        def step(x, zeta, rate):
            nonlocal past
            b, k, start = source(x, rate), self.step, zeta
            if not self.two_step:
                return diffuse(k, start, b)
            later, extrapolated, zero = 2.0 / 3.0 * self.step, b, np.zeros_like(zeta)
            if past:
                # ζ̃ = ζ + e corrects the last ζ, whose step had an extrapolated source.
                k, predicted, old, before = past
                zeta = zeta + diffuse(k, zero, b - predicted)
                k, start, extrapolated = later, (4.0 * zeta - old) / 3.0, np.minimum(2.0 * b - before, 0.0)
            else:
                # The first step is Euler's. It also makes the factor of the others, as their times are compared.
                diffuse(later, zero, zero)
            past = k, extrapolated, zeta, b
            return diffuse(k, start, extrapolated)

        return step

    def run(self, program, damage, assemble, contact):
        """Makes all steps, until ζ reaches its threshold, and prints the answer. `damage` has the two functions of
        `damage_step`; one function instead returns Euler's ζ from the last u and ζ and the rate of φ without strains.
        `assemble` makes K for η, and `contact` returns u from a guess, f and the gaps."""
        if callable(damage) and self.two_step:
            sys.exit("this peer makes Euler's steps alone")
        damage = damage if callable(damage) else self.damage_step(*damage)
        x, f = np.zeros((2, len(self.unknowns)))
        before, zeta, seconds = x, np.ones(len(self.points)), []
        for n, (load, gap) in enumerate(zip(self.arrays["load"], self.arrays["gap"])):
            started = time.perf_counter()
            if n:
                next_zeta = damage(x, zeta, self.lambda_d * (1.0 / eta - 1.0) - self.lambda_w)
                if next_zeta.min() <= self.threshold:
                    break
                zeta = next_zeta
            eta = np.clip(zeta, self.threshold, 1.0)
            assemble(eta)
            assembled, f[self.loaded] = time.perf_counter(), load
            # The guess is the linear extrapolation of the last two states.
            x, before = contact(2.0 * x - before, f, gap), x
            seconds.append(time.perf_counter() - started)
            if not n:
                solve = time.perf_counter() - assembled
        u = x[self.unknowns].reshape(-1, 2)
        if len(sys.argv) > 2:
            np.savez(sys.argv[2], u=u, zeta=zeta)
        print(json.dumps({
            "program": program, "seconds": seconds, "solve": solve, "zeta_min": float(zeta.min()), "work": float(f @ x),
            "displacement_max": float(np.hypot(*u.T).max()), "steps": len(seconds) - 1,
        }))
