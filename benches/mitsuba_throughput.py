"""Samples per CPU-second of Mitsuba 3's path tracer, for `cargo bench --bench throughput -- --compare PYTHON`.

Reads lines `SCENE.xml WIDTH HEIGHT MAX_DEPTH SPP SEED` from standard input and answers each with
`SAMPLES CPU_SECONDS R G B` on one line. A scene's first render, which compiles its kernels, is not counted. The variant is
the first argument.
"""

import resource
import sys

import mitsuba as mi

mi.set_variant(sys.argv[1])
scenes = {}


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def render(scene, spp, seed):
    # Asking for the values waits for the kernels to finish.
    return mi.TensorXf(mi.render(scene, spp=spp, seed=seed)).numpy()


for line in sys.stdin:
    path, width, height, max_depth, spp, seed = line.split()
    width, height, spp, seed = int(width), int(height), int(spp), int(seed)
    key = (path, width, height, max_depth)
    if key not in scenes:
        scenes[key] = mi.load_file(path, resx=width, resy=height, max_depth=int(max_depth))
        render(scenes[key], spp, seed + 1_000_003)
    before = cpu_seconds()
    image = render(scenes[key], spp, seed)
    seconds = cpu_seconds() - before
    print(width * height * spp, seconds, *image.mean(axis=(0, 1))[:3], flush=True)
