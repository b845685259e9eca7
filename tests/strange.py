"""Campaigns that nobody expects but the door lets in: campaign.toml, and the files beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from campaigns import csv, decay
from small_rig import RIG, record

Files = dict[str, str]
Strange = tuple[str, Files]

HEAD = 'name = "rig"\nmass_kg = 0.503\n'
PLAIN = HEAD + "stop = false\n"
ONE = '[[recording]]\nfile = "a.csv"\n'
TWO = ONE + '[[recording]]\nfile = "b.csv"\n'
STOP = ONE + 'case = "1"\n'
STOPS = STOP + '[[recording]]\nfile = "b.csv"\ncase = "2"\n'
T = np.arange(600) * 2e-3


def noisy(samples: np.ndarray, level: float = 5e-6, seed: int = 0) -> np.ndarray:
    return samples + level * np.random.default_rng(seed).standard_normal(samples.size)


def plain(
    samples: np.ndarray | None = None, more: str = "", toml: str = PLAIN, **layout: object
) -> Strange:
    """One recording of a plain oscillator; `more` follows its [[recording]]."""
    given = noisy(decay()) if samples is None else samples
    return toml + ONE + more, {"a.csv": csv(given, **layout)}


def pair(first: np.ndarray, second: np.ndarray, **layout: object) -> Strange:
    """Two recordings of a plain oscillator; `layout` is the second one's."""
    return PLAIN + TWO, {"a.csv": csv(first), "b.csv": csv(second, **layout)}


def impacts(more: str = "", rest: int = 0, toml: str = HEAD, **rig: object) -> Strange:
    """A release of the small rig with other parameters, after some samples at rest in the hand."""
    samples = record(seed=3, rig=replace(RIG, **rig), duration=1.0).recordings[0].samples
    samples = noisy(np.concatenate([np.full(rest, samples[0]), samples]))
    return toml + STOP + more, {"a.csv": csv(samples, interval=1e-3)}


def prior(name: str, mean: float, sd: float) -> str:
    return f'[priors]\n"{name}" = {{ distribution = "normal", mean = {mean}, sd = {sd} }}\n'


def driven(force: np.ndarray, motion: np.ndarray) -> Strange:
    """A recording with a measured force."""
    rows = zip(T, motion, force, strict=True)
    lines = [f"{t:.6f},{y:.12g},{f:.9g}" for t, y, f in rows]
    text = "\n".join(["time_s,displacement_m,force", *lines]) + "\n"
    return PLAIN + ONE + 'input = { column = "force", kind = "force_N" }\n', {"a.csv": text}


def of_quantity(order: int, header: str, mass: str = PLAIN) -> Strange:
    """The same decay as a velocity, an acceleration or an angle."""
    w = 2 * np.pi * 6.4
    wave = (-np.cos(w * T), w * np.sin(w * T), w**2 * np.cos(w * T))[order]
    samples = noisy(6e-3 * np.exp(-0.15 * T) * wave, 1e-3 * 6e-3 * w**order)
    return plain(samples, toml=mass, header=header)


def many(count: int, size: int) -> Strange:
    """Many short recordings."""
    names = [f"r{k}" for k in range(count)]
    toml = PLAIN + "".join(f'[[recording]]\nfile = "{name}.csv"\n' for name in names)
    return toml, {f"{n}.csv": csv(noisy(decay(size), seed=k)) for k, n in enumerate(names)}


def spiked(step: int, height: float) -> np.ndarray:
    samples = noisy(decay())
    samples[step // 2 :: step] += height
    return samples


def coloured(memory: float) -> np.ndarray:
    """Noise that forgets slowly."""
    white, noise = np.random.default_rng(0).standard_normal(600), np.zeros(600)
    for k in range(1, 600):
        noise[k] = memory * noise[k - 1] + white[k]
    return decay() + 5e-6 * noise


NAMES = HEAD.replace('"rig"', '"$x$ <b>&amp; \\\\frac{ é"') + ONE + f'case = "{"$][" * 66}"\n'
RUBBER = "[beam.1]\nlength_mm = 100.0\nwidth_mm = 1.0\nthickness_mm = 0.1\n"
RUBBER += "youngs_modulus_mpa = 10.0\n"
MEASURED = "[measurement]\n"
SMOOTH = MEASURED + "smoothing = "

STRANGE: dict[str, Callable[[], Strange]] = {
    "no noise": lambda: plain(decay()),
    "no noise and no contact": lambda: (HEAD + STOPS, {"a.csv": csv(), "b.csv": csv()}),
    "steps of 1 mm": lambda: plain(np.round(noisy(decay()), 3)),
    "growing": lambda: plain(noisy(decay())[::-1]),
    "a mass of 1e-15 kg": lambda: plain(toml=PLAIN.replace("0.503", "1e-15")),
    "a prior of twice the stiffness": lambda: plain(more=prior("k1", 1600.0, 1e-3)),
    "rest before the release": lambda: impacts(rest=300),
    "names": lambda: (NAMES, impacts()[1]),
    # what the readings are
    "steps of 0.1 mm": lambda: plain(np.round(noisy(decay()), 4)),
    "eight bits": lambda: plain(np.round(noisy(decay()) * 128 / 6e-3) * 6e-3 / 128),
    "held over ten samples": lambda: plain(np.repeat(noisy(decay())[::10], 10)),
    "clipped": lambda: plain(np.clip(noisy(decay()), -4e-3, 4e-3)),
    "one reading of 3 cm": lambda: plain(spiked(600, 0.03)),
    "twelve spikes": lambda: plain(spiked(50, 2e-3)),
    "a rest reading of 1 m": lambda: plain(noisy(decay()) + 1.0),
    "a probe that drifts": lambda: plain(noisy(decay()) + 1e-3 * T),
    "nanometres": lambda: plain(1e-6 * noisy(decay())),
    "metres": lambda: plain(1e3 * noisy(decay()) / 6),
    "as much noise as motion": lambda: plain(noisy(decay(), 3e-3)),
    "hum as large as the motion": lambda: plain(noisy(decay() + 3e-3 * np.sin(314.159 * T))),
    "heavy tails": lambda: plain(decay() + 5e-6 * np.random.default_rng(0).standard_t(2, 600)),
    "noise that grows": lambda: plain(decay() + (noisy(decay()) - decay()) * (1 + 5 * T)),
    "slow noise": lambda: plain(coloured(0.99)),
    "smooth noise": lambda: plain(np.convolve(noisy(decay()), np.ones(9) / 9, "same")),
    # what the motion is
    "no damping": lambda: plain(noisy(-6e-3 * np.cos(40 * T))),
    "two periods and rest": lambda: plain(noisy(-6e-3 * np.exp(-12 * T) * np.cos(40 * T))),
    "beats": lambda: plain(noisy(3e-3 * (np.cos(40 * T) + np.cos(43 * T)))),
    "a chirp": lambda: plain(noisy(6e-3 * np.cos((30 + 10 * T) * T))),
    "nearly a square wave": lambda: plain(noisy(6e-3 * np.tanh(5 * np.cos(40 * T)))),
    "a sawtooth": lambda: plain(noisy(6e-3 * (T * 6.4 % 1.0 - 0.5))),
    "two releases": lambda: plain(noisy(np.concatenate([decay(300), decay(300)]))),
    "rest after half": lambda: plain(noisy(np.where(T < 0.6, decay(), 0.0))),
    "one harmonic more": lambda: plain(noisy(decay() + 1e-3 * np.cos(80.4 * T))),
    # clocks and sizes
    "five samples a period": lambda: plain(noisy(decay(120, 0.03)), interval=0.03),
    "a clock that starts late": lambda: plain(start=1e4),
    "microseconds": lambda: plain(noisy(decay(60_000, 2e-5)), interval=2e-5),
    "a hundred seconds": lambda: plain(noisy(decay(50_000))),
    "three periods": lambda: plain(noisy(decay(240))),
    "forty recordings": lambda: many(40, 240),
    "the same file twice": lambda: pair(noisy(decay()), noisy(decay())),
    "one of the two upside down": lambda: pair(noisy(decay()), -noisy(decay(), seed=1)),
    "one of the two in another unit": lambda: pair(noisy(decay()), 1e3 * noisy(decay(), seed=1)),
    "two rates": lambda: pair(noisy(decay()), noisy(decay(900, 1e-3)), interval=1e-3),
    "another rig": lambda: pair(noisy(decay()), noisy(decay(interval=3e-3))),
    "most is left out": lambda: plain(more="exclude_s = [[0.2, 1.1]]\n"),
    # what campaign.toml says
    "a mass of 1e12 kg": lambda: plain(toml=PLAIN.replace("0.503", "1e12")),
    "noise said far too small": lambda: plain(more=MEASURED + "noise_um = 0.001\n"),
    "noise said far too large": lambda: plain(more=MEASURED + "noise_um = 1000.0\n"),
    "a filter that was not there": lambda: plain(
        more=SMOOTH + '{ kind = "savgol", window = 51, polyorder = 2 }\n'
    ),
    "a lag that was not there": lambda: plain(
        more=SMOOTH + '{ kind = "lag", time_constant_s = 0.01 }\n'
    ),
    "a clock of ten per cent": lambda: plain(more=MEASURED + "clock_uncertainty_ppm = 1e5\n"),
    "a gain of ten per cent": lambda: plain(more=MEASURED + "gain_uncertainty_percent = 10.0\n"),
    "the tail alone": lambda: plain(more="start_s = 0.8\n"),
    "upside down": lambda: plain(more="scale = -1.0\n"),
    "a clock of half the speed": lambda: plain(more="clock_ratio = 2.0\n"),
    "spikes that are to be kept": lambda: plain(spiked(50, 2e-3), toml=f'faults = "keep"\n{PLAIN}'),
    "half of the mass unsure": lambda: plain(toml=f"mass_uncertainty_kg = 0.25\n{PLAIN}"),
    "a beam as soft as rubber": lambda: impacts(RUBBER),
    # quantities and inputs
    "velocities": lambda: of_quantity(1, "time_s,velocity_m_s"),
    "accelerations": lambda: of_quantity(2, "time_s,acceleration_m_s2"),
    "angles": lambda: of_quantity(0, "time_s,angle_rad"),
    "hardly a force": lambda: driven(np.where(T < 1, 0, 1e-9), noisy(decay())),
    "a force that does nothing": lambda: driven(1e3 * np.sin(17 * T), noisy(decay())),
    "the motion as the force": lambda: driven(decay(), noisy(decay())),
    # the stop
    "a stop that is never met": lambda: (HEAD + STOP, {"a.csv": csv(noisy(decay() * 0.1))}),
    "a wall": lambda: impacts(k2={"1": 1e7, "2": 1e7}),
    "a stop like a feather": lambda: impacts(k2={"1": 5.0, "2": 5.0}, c2=0.01),
    "a stop that swallows the swing": lambda: impacts(c2=60.0),
    "no gap": lambda: impacts(g=0.0),
    "a stop that is always met": lambda: impacts(g=-8e-3),
    "a prior far from the gap": lambda: impacts(prior("g", 5e-3, 1e-5)),
}
