"""nadir build as a process: killed, resumed, divided, watched."""
import filecmp
import json
import os
import pathlib
import random
import signal
import subprocess
import tempfile
import time
import unittest

import numpy
from osgeo import gdal, osr

gdal.UseExceptions()
NADIR = os.environ["NADIR_BIN"]


def make_source(path, width=3000, height=2300, options=()):
    """Noise and shapes: nothing repeats, so that a tile in the wrong place shows."""
    generator = numpy.random.default_rng(5)
    raster = gdal.GetDriverByName("GTiff").Create(str(path), width, height, 3, gdal.GDT_Byte, options=list(options))
    crs = osr.SpatialReference()
    crs.ImportFromEPSG(32614)
    raster.SetProjection(crs.ExportToWkt())
    raster.SetGeoTransform([600000, 0.5, 0, 4200000, 0, -0.5])
    y, x = numpy.mgrid[0:height, 0:width]
    for band in range(3):
        wave = 100 + 60 * numpy.sin(x / (7 + band)) * numpy.cos(y / 11)
        raster.GetRasterBand(band + 1).WriteArray((wave + generator.integers(0, 40, (height, width))).astype("u1"))
    raster = None
    return path


def build(*arguments, **more):
    return subprocess.run([NADIR, "build", *map(str, arguments)], capture_output=True, text=True, **more)


class Build(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        cls.source = make_source(cls.path / "source.tif")
        cls.whole = cls.path / "whole.tif"
        done = build(cls.source, "-o", cls.whole, "--tile-size", 128, "--level", 3)
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def expect_same(self, other):
        self.assertTrue(filecmp.cmp(self.whole, other, shallow=False), f"{other} differs")

    def test_the_bytes_depend_on_neither_threads_nor_memory(self):
        for name, more in {"one": ("--threads", 1), "many": ("--threads", 7), "little": ("--memory", "128MiB"),
                           "least": ("--memory", "4MiB", "--threads", 1)}.items():
            out = self.path / f"{name}.tif"
            done = build(self.source, "-o", out, "--tile-size", 128, "--level", 3, *more)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.expect_same(out)

    def test_a_build_that_is_killed_at_any_moment_goes_on(self):
        out = self.path / "killed.tif"
        command = [NADIR, "build", str(self.source), "-o", str(out), "--tile-size", "128", "--level", "3"]
        chance = random.Random(3)
        interrupted = 0
        for attempt in range(200):
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            try:
                process.communicate(timeout=0.02 + 0.03 * chance.random() + 0.03 * attempt)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.communicate()
                interrupted += 1
                if out.exists():  # killed between its appearance and the end of the process
                    break
                continue
            self.assertEqual(process.returncode, 0)
            self.assertFalse(pathlib.Path(f"{out}.building").exists())
            break
        self.assertGreater(interrupted, 0)
        self.expect_same(out)

    def test_what_was_done_is_not_done_again(self):
        out = self.path / "resumed.tif"
        command = [NADIR, "build", str(self.source), "-o", str(out), "--tile-size", "128", "--compress", "lzma"]
        journal = pathlib.Path(f"{out}.building") / "journal"
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not (journal.exists() and journal.stat().st_size > 1000):
            self.assertIsNone(process.poll(), "it ended before it could be killed")
            time.sleep(0.005)
        process.kill()
        process.wait()
        done = subprocess.run([*command, "--json"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(json.loads(done.stdout)["kept_squares"], 0)

        # Another build under the same name has no use for it.
        process = subprocess.Popen([*command, "--force"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not (journal.exists() and journal.stat().st_size > 1000):
            time.sleep(0.005)
        process.kill()
        process.wait()
        done = build(self.source, "-o", out, "--tile-size", 128, "--level", 3, "--force", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["kept_squares"], 0)
        self.expect_same(out)

    def test_a_damaged_journal_costs_time_only(self):
        out = self.path / "journal.tif"
        command = [NADIR, "build", str(self.source), "-o", str(out), "--tile-size", "128", "--level", "3"]
        folder = pathlib.Path(f"{out}.building")
        chance = random.Random(11)
        for damage in range(6):
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            while process.poll() is None and not (folder.exists() and (folder / "journal").exists()
                                                  and (folder / "journal").stat().st_size > 2000):
                time.sleep(0.002)
            process.kill()
            process.wait()
            if out.exists():
                out.unlink()
                continue
            journal = bytearray((folder / "journal").read_bytes())
            if damage % 3 == 0:
                del journal[chance.randrange(len(journal)):]
            else:
                for _ in range(1 + damage):
                    journal[chance.randrange(len(journal))] = chance.randrange(256)
            (folder / "journal").write_bytes(journal)
            done = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.expect_same(out)
            out.unlink()

    def test_shards_come_together_to_the_same_bytes(self):
        out = self.path / "sharded.tif"
        options = ("--tile-size", 128, "--level", 3)
        for shard in (2, 3, 1):
            done = build(self.source, "-o", out, *options, "--shard", f"{shard}/3")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertFalse(out.exists())
        done = build(self.source, "-o", out, *options, "--join", 3)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.expect_same(out)
        self.assertEqual(list(self.path.glob("sharded.tif.*")), [])

    def test_a_missing_or_foreign_shard_is_named(self):
        out = self.path / "incomplete.tif"
        options = ("--tile-size", 128, "--level", 3)
        build(self.source, "-o", out, *options, "--shard", "1/2")
        done = build(self.source, "-o", out, *options, "--join", 2)
        self.assertEqual(done.returncode, 1)
        self.assertIn("shard-2-of-2", done.stderr)
        build(self.source, "-o", out, "--tile-size", 256, "--shard", "2/2")
        done = build(self.source, "-o", out, *options, "--join", 2)
        self.assertEqual(done.returncode, 1)
        self.assertIn("other options", done.stderr)
        self.assertFalse(out.exists())

    def test_two_processes_do_not_build_one_map(self):
        out = self.path / "twice.tif"
        command = [NADIR, "build", str(self.source), "-o", str(out), "--tile-size", "128", "--compress", "lzma"]
        first = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not pathlib.Path(f"{out}.building/journal").exists():
            time.sleep(0.002)
        second = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(second.returncode, 1)
        self.assertIn("another process is building this map", second.stderr)
        first.kill()
        first.wait()

    def test_wide_strips_are_unpacked_once_and_the_plan_says_so(self):
        strips = make_source(self.path / "strips.tif", options=("COMPRESS=DEFLATE",))
        plan = build(strips, "-o", self.path / "plan.tif", "--tile-size", 128, "--memory", "16MiB", "--explain")
        self.assertEqual(plan.returncode, 0, plan.stderr)
        self.assertIn("unpacked to disk once", plan.stdout)
        self.assertFalse((self.path / "plan.tif").exists())
        out = self.path / "from_strips.tif"
        done = build(strips, "-o", out, "--tile-size", 128, "--level", 3, "--memory", "16MiB")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.expect_same(out)


if __name__ == "__main__":
    unittest.main()
