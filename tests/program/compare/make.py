"""Makes the pictures of this folder, and expected.json with what other implementations say of them.

    pip install flip-evaluator==1.7 numpy==2.4.6 scikit-image==0.26.0 pillow==13.0.0
    python make.py

FLIP is by its authors' program (flip-evaluator), MSE and PSNR by scikit-image, the others by numpy.
"""

import json

import flip_evaluator
import numpy as np
from PIL import Image
from skimage.metrics import mean_squared_error, peak_signal_noise_ratio

EPS = 0.01
random = np.random.default_rng(1)


def scene(width, height):
    """A ramp, a disk, stripes: smooth parts, edges and fine detail; linear, 0 to 1."""
    y, x = np.mgrid[0:height, 0:width] / [[[height]], [[width]]]
    picture = np.stack([x, 0.5 * y, 0.6 - 0.5 * x], -1)
    picture[(x - 0.35) ** 2 + (y - 0.5) ** 2 < 0.06] = [0.9, 0.6, 0.05]
    stripes = (x > 0.65) & (np.arange(width) % 4 < 2)
    picture[stripes] *= 0.4
    return picture


def encode(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def decode(srgb):
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def write_pfm(name, picture):
    height, width, _ = picture.shape
    with open(name, "wb") as file:
        file.write(f"PF\n{width} {height}\n-1.0\n".encode())
        file.write(picture[::-1].astype("<f4").tobytes())


def figures(a, b, shown_a, shown_b, error, pixels):
    return {
        "mse": mean_squared_error(b, a),
        "rmse": float(np.sqrt(np.mean((a - b) ** 2))),
        "relmse": np.mean((a - b) ** 2 / (b**2 + EPS)),
        "smape": np.mean(np.abs(a - b) / (np.abs(a) + np.abs(b) + EPS)),
        "psnr_db": peak_signal_noise_ratio(shown_b, shown_a, data_range=1.0),
        "flip": float(np.mean(error, dtype=np.float64)),
        "mean_a": np.mean(a),
        "mean_b": np.mean(b),
        "ratio": np.mean(a) / np.mean(b),
        # Column, row, FLIP.
        "flip_pixels": [[x, y, float(error[y, x])] for x, y in pixels],
    }


def flip(a, b, kind, parameters=None):
    error, _, used = flip_evaluator.evaluate(
        b.astype(np.float32), a.astype(np.float32), kind, applyMagma=False, parameters=dict(parameters or {})
    )
    return error[..., 0] if error.ndim == 3 else error, used


def pixels(picture):
    height, width, _ = picture.shape
    return [(int(x), int(y)) for x, y in zip(random.integers(0, width, 24), random.integers(0, height, 24))]


expected = {}

# On a display.
b = np.round(255 * encode(scene(64, 48))).astype(np.uint8)
noise = np.random.default_rng(2).normal(0, 8, b.shape)
a = np.clip(np.roll(b, 1, axis=1) + noise, 0, 255).round().astype(np.uint8)
Image.fromarray(a).save("a.png", optimize=True)
Image.fromarray(b).save("b.png", optimize=True)
a, b = a / 255, b / 255
error, _ = flip(a, b, "LDR")
expected["png"] = figures(decode(a), decode(b), a, b, error, pixels(b))
error, _ = flip(a, b, "LDR", {"ppd": 30.0})
expected["png_30_pixels_per_degree"] = {"flip": float(np.mean(error, dtype=np.float64))}

# With lights: up to 60.
b = (scene(36, 28) ** 1.5).astype(np.float32)
b[4:7, 20:24] = [60, 40, 20]
a = (b * np.random.default_rng(3).gamma(8, 1 / 8, b.shape)).astype(np.float32)
write_pfm("a.pfm", a)
write_pfm("b.pfm", b)
error, used = flip(a, b, "HDR")
a, b = a.astype(np.float64), b.astype(np.float64)
shown = [encode(np.clip(p, 0, 1)) for p in (a, b)]
expected["pfm"] = figures(a, b, *shown, error, pixels(b))
expected["pfm"] |= {
    "start_exposure": float(used["startExposure"]),
    "stop_exposure": float(used["stopExposure"]),
    "exposures": int(used["numExposures"]),
}

with open("expected.json", "w") as file:
    json.dump(expected, file, indent=1)
    file.write("\n")
