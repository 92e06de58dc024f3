"""Samples per CPU-second and variance of Mitsuba 3, for `cargo bench --bench throughput -- --compare PYTHON` and `--features testkit --bench volumes`.

Reads lines `SCENE.xml WIDTH HEIGHT MAX_DEPTH SPP SEED` from standard input and answers each with
`SAMPLES CPU_SECONDS MEAN VARIANCE` on one line: the mean of the image, and the variance of one sample, averaged over pixels and
channels, estimated from all images of the scene so far (not a number after the first). A scene's first render, which compiles its
kernels, is not counted. Roulette is off, whatever the scene's file says. The variant is the first argument.
"""

import resource
import sys

import mitsuba as mi

mi.set_variant(sys.argv[1])
scenes = {}


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def without_roulette(scene, max_depth):
    """The scene's integrator with a path that ends at its longest alone."""
    volumes = "Volumetric" in str(scene.integrator())
    return mi.load_dict({"type": "volpath" if volumes else "path", "max_depth": max_depth, "rr_depth": 1 << 20})


def render(scene, integrator, spp, seed):
    # Asking for the values waits for the kernels to finish.
    return mi.TensorXf(mi.render(scene, integrator=integrator, spp=spp, seed=seed)).numpy()


for line in sys.stdin:
    path, width, height, max_depth, spp, seed = line.split()
    width, height, spp, seed = int(width), int(height), int(spp), int(seed)
    key = (path, width, height, max_depth)
    if key not in scenes:
        scene = mi.load_file(path, resx=width, resy=height, max_depth=int(max_depth))
        integrator = without_roulette(scene, int(max_depth))
        render(scene, integrator, spp, seed + 1_000_003)
        scenes[key] = [scene, 0, 0.0, 0.0, integrator]
    state = scenes[key]
    before = cpu_seconds()
    image = render(state[0], state[4], spp, seed)
    seconds = cpu_seconds() - before
    # Welford's update.
    image = image.astype("float64")
    state[1] += 1
    delta = image - state[2]
    state[2] += delta / state[1]
    state[3] += delta * (image - state[2])
    variance = (state[3] / (state[1] - 1)).mean() * spp if state[1] > 1 else float("nan")
    print(width * height * spp, seconds, image.mean(), variance, flush=True)
