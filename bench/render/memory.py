#!/usr/bin/python3
"""Peak memory of rendering beside the promise: cache budget + frame buffers + 64 MiB, for a small and a large map.

memory.py NADIR SOURCE_DIR: makes the large map (naip_2014.tif, 16 times as wide and high) in a temporary folder."""
import os
import pathlib
import subprocess
import sys
import tempfile

MIB = 1 << 20


def peak_bytes(*command):
    pid = os.fork()
    if pid == 0:
        with open(os.devnull, "w") as sink:
            os.dup2(sink.fileno(), 1), os.dup2(sink.fileno(), 2)
        os.execv(command[0], list(command))
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"failed: {' '.join(command)}")
    return usage.ru_maxrss * 1024


def main():
    nadir, demo = sys.argv[1], pathlib.Path(sys.argv[2]) / "sim/demo"
    small = demo / "maps/naip_2014.tif"
    frame_bytes = 1280 * 720 * (3 + 1)  # samples and validity
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        large = folder / "large.tif"
        subprocess.run(["gdal_translate", "-q", "-outsize", "1600%", "1600%", small, folder / "raw.tif", "-co", "TILED=YES", "-co", "COMPRESS=ZSTD"], check=True)
        subprocess.run([nadir, "build", folder / "raw.tif", "-o", large], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        print(f"{'map':<24}{'cache':>9}{'frames':>9}{'peak':>9}{'promise':>9}{'of it':>8}")
        for name, path in (("934 x 723", small), ("14944 x 11568", large)):
            for cache in (16, 64, 256):
                for frames in (1, 40):
                    peak = peak_bytes(nadir, "render", "--map", str(path), "--bands", "1,2,3", "--camera", str(demo / "runs/rgb.yaml"), "--poses", str(demo / "runs/naip.csv"),
                                      "--first", str(frames), "--cache", f"{cache}MiB", "--no-output")
                    promise = cache * MIB + frame_bytes + 64 * MIB
                    print(f"{name:<24}{cache:>5} MiB{frames:>9}{peak / MIB:>5.0f} MiB{promise / MIB:>5.0f} MiB{peak / promise:>8.2f}")


if __name__ == "__main__":
    main()
