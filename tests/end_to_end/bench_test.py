"""What `nadir bench` leaves and tells.

Needs the environment variable NADIR_BIN: the nadir command, beside it the programs that it uses.
"""
import csv
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

NADIR = os.environ["NADIR_BIN"]
COLUMNS = "suite,case,method,setting,error,error_unit,cpu_ms,wall_ms,peak_bytes,counters,commit"


def bench(*arguments, **environment):
    return subprocess.run([NADIR, "bench", *map(str, arguments)], capture_output=True, text=True, timeout=240,
                          env={**os.environ, **environment})


class Bench(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="nadir-bench-test-"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def assert_fault(self, done, *words):
        self.assertNotEqual(done.returncode, 0)
        self.assertTrue(done.stderr.startswith("nadir bench: "), done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def bench_without_peers(self, *arguments):
        """Run where of all peers only Nadir's own lies beside the program."""
        alone = self.folder / "alone"
        if not alone.exists():
            alone.mkdir()
            beside = pathlib.Path(NADIR).parent
            for program in [beside / "nadir-bench", beside / "nadir-build", beside / "nadir-peer-nadir",
                            *beside.glob("*.so")]:
                shutil.copy(program, alone)
        return subprocess.run([alone / "nadir-bench", *arguments], capture_output=True, text=True, timeout=240)

    def test_a_suite_leaves_results_that_can_be_drawn_again_and_merged(self):
        first, merged = self.folder / "first", self.folder / "merged"
        done = bench("start", "--rounds", 3, "-o", first)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("gdalinfo", done.stdout)
        with open(first / "results.csv", newline="") as file:
            self.assertEqual(file.readline().strip(), COLUMNS)
            file.seek(0)
            rows = list(csv.DictReader(file))
        self.assertEqual([row["method"] for row in rows], ["nadir --version", "nadir info", "gdalinfo"])
        for row in rows:
            self.assertGreater(float(row["wall_ms"]), 0)
            self.assertGreater(int(row["peak_bytes"]), 0)
            self.assertIn("rounds=3", row["counters"])
        self.assertIn(f"bench start --rounds 3 -o {first}", (first / "report.html").read_text())
        self.assert_fault(bench("start", "-o", first), str(first), "--force")

        done = bench("report", first / "results.csv", first / "results.csv", "-o", merged)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(merged / "results.csv", newline="") as file:
            self.assertEqual(list(csv.DictReader(file)), rows + rows)

    def test_json_holds_the_rows(self):
        done = bench("start", "--quick", "--case", "map", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)
        self.assertEqual(len(rows), 3)
        self.assertIn("ratio:gdalinfo", rows[1]["counters"])

    def test_builders_are_measured_and_what_they_made_is_checked(self):
        out, kept = self.folder / "build", self.folder / "kept"
        sizes = ("--quick", "--side", 640, "--repeat", 1, "--sources", 4, "--keep", kept)
        done = bench("build", *sizes, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(list(kept.glob("photo_640_*.tif")), "sources are kept")
        self.assertEqual(len(list(kept.glob("two_zones_4/zone3?_*.tif"))), 4)
        with open(out / "results.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        cases = {row["case"] for row in rows}
        self.assertLessEqual({"none", "jpeg 4:2:0", "deflate 6", "zstd 1", "zstd 3", "zstd 9"}, cases)
        for row in rows:
            counters = dict(pair.split("=", 1) for pair in row["counters"].split(";"))
            self.assertNotIn("fault", counters, row)
            if "left_out" in counters:
                self.assertEqual(row["wall_ms"], "", row)
                continue
            self.assertGreater(float(row["wall_ms"]), 0, row)
            self.assertGreater(int(counters["written_bytes"]), 0, row)
            if "alone" not in row["method"]:
                self.assertGreater(int(row["peak_bytes"]), 1 << 20, row)
            if "mosaic" in row["case"]:
                # Bilinear values of 8 bits, noise of 0.3 levels over 1024 texels with a slope of 28 levels a texel:
                # a thousandth; warping within an eighth of a texel comes on top.
                self.assertLess(float(row["error"]), 0.13, row)
        for case in cases:
            if "mosaic" not in case:
                self.assertTrue(any(row["case"] == case and row["method"].startswith("nadir") and row["wall_ms"] for row in rows))

    def test_frames_are_measured_beside_what_they_ought_to_show(self):
        out = self.folder / "render"
        done = bench("render", "--quick", "--rounds", 1, "--case", "o75", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(out / "results.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        kinds = ("o75, ", "cold, ", "growth ", "u16 x 4, ", "f32 x 1, ")
        for kind in kinds:
            self.assertTrue(any(row["case"].startswith(kind) for row in rows), kind)
        views = [row for row in rows if row["case"].startswith("o75, ")]
        for row in views:
            counters = dict(pair.rsplit("=", 1) for pair in row["counters"].split(";"))
            if "left_out" in counters:
                self.assertEqual(row["wall_ms"], "", row)
                continue
            for column in ("wall_ms", "cpu_ms", "error", "peak_bytes"):
                self.assertGreater(float(row[column]), 0, row)
            # Every method shows the same picture: nothing that moves it by a pixel or exchanges bands reaches this
            self.assertGreater(float(counters["psnr_image_db"]), 25, row)
            self.assertLess(float(counters["homography_error_px"]), 0.01, row)
        told = {row["method"]: row["counters"] for row in views}
        self.assertIn("ratio:", told["nadir balanced"])
        page = (out / "report.html").read_text()
        self.assertIn("<svg", page)
        if list(out.glob("*-crops.png")):
            self.assertIn("data:image/png;base64,", page)

        # A peer whose program is not there is left out, and said to be
        done = self.bench_without_peers("render", "--quick", "--rounds", "1", "--case", "o75, ", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        left = {row["method"]: row for row in json.loads(done.stdout) if row["case"].startswith("o75, ")}
        self.assertGreater(left["nadir draft"]["wall_ms"], 0)
        self.assertIn("nadir-peer-opencv was not built", left["original"]["counters"]["left_out"])
        self.assertNotIn("wall_ms", left["original"])

    def test_gated_counts_stand_beside_ratios_to_peers_that_gate_nothing(self):
        def rows_of(done):
            self.assertEqual(done.returncode, 0, done.stderr)
            return {row["method"]: row for row in json.loads(done.stdout)}

        asked = ("ci", "--case", "beside peers, o75", "--json")
        alone = rows_of(self.bench_without_peers(*asked))
        self.assertEqual(len(alone), 6)
        for name, row in alone.items():
            if name.startswith("nadir "):
                self.assertGreater(row["cpu_ms"], 0, row)
                self.assertGreater(float(row["counters"]["psnr_image_db"]), 30, row)
            else:
                self.assertIn("nadir-peer-opencv was not built", row["counters"]["left_out"])
        if not (pathlib.Path(NADIR).parent / "nadir-peer-opencv").exists():
            self.skipTest("no OpenCV: no peer to stand beside")
        together = rows_of(bench(*asked))
        for ours, peer in (("draft", "linear"), ("balanced", "linear 2x2"), ("best", "linear 4x4")):
            counters = together[f"nadir {ours}"]["counters"]
            self.assertGreater(float(counters[f"cpu_ratio:GDAL + OpenCV {peer}, 1 thread"]), 0)
            self.assertFalse([key for key in counters if "aim:" in key], "a ratio is of interest only")

    def test_a_builder_that_fails_is_told_and_not_timed(self):
        programs = self.folder / "programs"
        programs.mkdir()
        fake = programs / "gdal_translate"
        fake.write_text("#!/bin/sh\necho 'no such luck' >&2\nexit 3\n")
        fake.chmod(0o755)
        path = f"{programs}:{os.environ['PATH']}"
        done = bench("build", "--side", 512, "--repeat", 1, "--case", "zstd 1", "--json", PATH=path)
        self.assert_fault(done, "GDAL COG", "no such luck")
        rows = {row["method"]: row for row in json.loads(done.stdout)}
        self.assertIn("no such luck", rows["GDAL COG"]["counters"]["fault"])
        self.assertNotIn("wall_ms", rows["GDAL COG"])
        self.assertGreater(rows["nadir"]["wall_ms"], 0)

        # One that says that all went well, and leaves something else
        fake.write_text('#!/bin/bash\nexec /usr/bin/gdal_translate -q -outsize 50% 50% "${@: -2:1}" "${@: -1}"\n')
        done = bench("build", "--side", 512, "--repeat", 1, "--case", "zstd 1", "--json", PATH=path)
        self.assert_fault(done, "GDAL COG", "256 x 256", "expected 512 x 512")

    def test_the_list_names_suites_and_cases(self):
        listed = bench("--list").stdout
        self.assertIn("start", listed)
        self.assertIn("look at a map", listed)

    def test_faults_say_what_to_do(self):
        self.assert_fault(bench(), "--list")
        self.assert_fault(bench("strat"), "no suite 'strat'", "start")
        self.assert_fault(bench("start", "--case", "no such"), "no case", "--list")
        self.assert_fault(bench("report", "-o", self.folder / "r"), "CSV")
        bad = self.folder / "bad.csv"
        bad.write_text(COLUMNS + "\nstart,c,m,,,,fast,,,,\n")
        self.assert_fault(bench("report", bad, "-o", self.folder / "r"), "bad.csv: line 2: cpu_ms is 'fast'")
        self.assertFalse((self.folder / "r").exists())


if __name__ == "__main__":
    unittest.main()
