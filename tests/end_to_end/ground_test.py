"""Flights that meet the ground, by the command: what they tell, what they leave, and how they end."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import jsonschema

NADIR = os.environ["NADIR_BIN"]
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
RUNS = SOURCE / "sim/demo/runs"


def fly(*arguments):
    return subprocess.run([NADIR, "fly", *map(str, arguments)], capture_output=True, text=True, timeout=120)


def events_of(folder):
    schema = json.loads((SOURCE / "sim/record/events.schema.json").read_text())
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    for event in events:
        jsonschema.validate(event, schema)
    return events


def telemetry_of(folder):
    header, *rows = (folder / "telemetry/plane/state.csv").read_text().splitlines()
    return [dict(zip(header.split(","), row.split(","))) for row in rows]


class Ground(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nadir-ground-"))
        self.out = self.folder / "out"
        shutil.copy(RUNS / "rgb.yaml", self.folder)

    def tearDown(self):
        shutil.rmtree(self.folder)

    def run_file(self, *replacements):
        text = (RUNS / "circuit.yaml").read_text()
        for old, new in (("../maps/", f"{SOURCE}/sim/demo/maps/"), *replacements):
            self.assertIn(old, text)
            text = text.replace(old, new)
        path = self.folder / "run.yaml"
        path.write_text(text)
        return path

    def crashing(self):
        """A gust presses it into the ground on the first leg, seconds of which a camera sees."""
        return self.run_file(("turbulence: {intensity: light}", "gusts: [{start_s: 2, speed_mps: 15, gradient_m: 20, shape: step, towards: down}]"), ("height: 0 agl, yaw_deg: 0", "height: 20 agl, yaw_deg: 0"), ("takeoff: {clear_m: 20}", ""), ("land: {north_m: 100, east_m: 0, yaw_deg: 0}", ""),
                             ("{north_m: 600, east_m: 0, height: 60 agl}", "{north_m: 600, east_m: 0, height: 20 agl}"))

    def test_a_circuit_ends_where_it_is_told_to(self):
        done = fly(self.run_file(("rate_hz: 1", "rate_hz: 0.02")), "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([e["event"] for e in events_of(self.out)], ["lift-off", "touch-down", "landed"])
        first, last = telemetry_of(self.out)[0], telemetry_of(self.out)[-1]
        for row in (first, last):
            self.assertLess(abs(float(row["velocity_north_mps"])), 0.01)
        self.assertEqual(last["wheels_on_ground"], "3")
        self.assertAlmostEqual(float(last["ground_force_n"]), 11 * 9.8, delta=5)
        self.assertIn("landed", (self.out / "report.html").read_text())

    def test_a_crash_keeps_what_was_recorded_and_is_no_success(self):
        done = fly(self.crashing(), "-o", self.out)
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(len([line for line in done.stderr.splitlines() if "crash" in line]), 1, done.stderr)
        self.assertRegex(done.stderr, r"vehicle plane: crash at \d+\.\d{3} s: .* meets the ground|breaks")
        crash = events_of(self.out)[-1]
        self.assertTrue(crash["ends_flight"])
        rows = telemetry_of(self.out)
        self.assertLessEqual(int(rows[-1]["time_ns"]), crash["time_ns"])
        self.assertGreater(int(rows[-1]["time_ns"]), crash["time_ns"] - 20_000_001, "telemetry goes on to the crash")
        frames = [json.loads(line) for line in (self.out / "frames.jsonl").read_text().splitlines()]
        self.assertEqual(len(frames), crash["time_ns"] // 1_000_000_000 + 1)
        for frame in frames:
            self.assertTrue((self.out / frame["file"]).exists())
        for path in ("telemetry/plane/state.csv", "frames.jsonl", "events.jsonl"):
            self.assertNotIn("nan", (self.out / path).read_text().lower())
        self.assertIn("crash at", (self.out / "report.html").read_text())
        again = subprocess.run([NADIR, "verify", self.out], capture_output=True, text=True, timeout=120)
        self.assertEqual(again.returncode, 0, again.stdout + again.stderr)

    def test_a_crash_is_in_the_summary_for_programs_and_told_by_doctor(self):
        run = self.crashing()
        done = fly(run, "-o", self.out, "--json", "--dry-run")
        self.assertNotEqual(done.returncode, 0)
        summary = json.loads(done.stdout)
        self.assertTrue(summary["ended_early"])
        self.assertEqual(summary["events"][-1]["event"], "crash")
        self.assertLess(summary["simulated_seconds"], 215)
        doctor = subprocess.run([NADIR, "doctor", run], capture_output=True, text=True, timeout=120)
        self.assertIn("the run ends early: vehicle plane: crash", doctor.stdout)

    def test_what_cannot_begin_or_end_so_is_told(self):
        for replacement, told in ((("height: 0 agl, yaw_deg: 0", "height: 50 agl, yaw_deg: 0"), "expected a start on the ground"),
                                  (("takeoff: {clear_m: 20}", "takeoff: {launch_mps: 14}"), "expected a start above the ground to launch it from"),
                                  (("takeoff: {clear_m: 20}", "takeoff: {rotate: 12}"), "rotate_mps"),
                                  (("turn_radius_m: 100", "repeat_mission: true"), "a mission that repeats never lands")):
            done = fly(self.run_file(replacement), "-o", self.out)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(told, done.stderr)


if __name__ == "__main__":
    unittest.main()
