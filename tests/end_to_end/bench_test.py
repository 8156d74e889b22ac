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


def bench(*arguments):
    return subprocess.run([NADIR, "bench", *map(str, arguments)], capture_output=True, text=True, timeout=120)


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
