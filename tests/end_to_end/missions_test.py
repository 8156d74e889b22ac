"""Missions before and after their flight, by the command: what is refused, what is told, and the plan in pictures."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
from osgeo import gdal

NADIR = os.environ["NADIR_BIN"]
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
RUNS = SOURCE / "sim/demo/runs"
MAPS = SOURCE / "sim/demo/maps"
gdal.UseExceptions()

PLANE = """
    model: aerosonde
    start: {north_m: -300, east_m: 0, height: 150 agl, yaw_deg: 0}
"""
COPTER = """
    model: multirotor
    start: {north_m: 0, east_m: 0, height: 40 agl, yaw_deg: 0}
"""
AHEAD = "{north_m: 800, east_m: 0}"


def nadir(*arguments):
    return subprocess.run([NADIR, *map(str, arguments)], capture_output=True, text=True, timeout=120)


class Missions(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nadir-missions-"))
        self.out = self.folder / "out"
        shutil.copy(RUNS / "rgb.yaml", self.folder)

    def tearDown(self):
        shutil.rmtree(self.folder)

    def run_file(self, vehicle, *items, more="", air="", duration_s=45, rate="0.2"):
        text = f"duration_s: {duration_s}\nscene:\n  ground: 560 msl\n  layers: {{photo: {{map: {MAPS}/naip_2014.tif, bands: [1, 2, 3]}}}}\n"
        text += f"{air}vehicles:\n  v:{vehicle}{more}    mission:\n" + "".join(f"      - {item}\n" for item in items)
        text += f"    sensors: {{rgb: {{layer: photo, camera: rgb.yaml, rate_hz: {rate}}}}}\n"
        path = self.folder / "run.yaml"
        path.write_text(text)
        return path

    def line_of(self, part):
        return 1 + next(i for i, line in enumerate((self.folder / "run.yaml").read_text().splitlines()) if part in line)

    def check_refused(self, run, item, told):
        flown = nadir("fly", run, "-o", self.out)
        self.assertNotEqual(flown.returncode, 0, told)
        self.assertIn("cannot be flown", flown.stderr)
        self.assertIn(told, flown.stderr)
        self.assertIn(f"run.yaml:{self.line_of(item)}: 'vehicles.v.mission[", flown.stderr)
        self.assertFalse(self.out.exists(), "nothing is left of what never began")
        doctor = nadir("doctor", run)
        self.assertNotEqual(doctor.returncode, 0)
        self.assertTrue(any(line.startswith("FAIL") and told in line for line in doctor.stdout.splitlines()), doctor.stdout)

    def check_told(self, run, told):
        flown = nadir("fly", run, "-o", self.out, "--dry-run", "--force")
        self.assertEqual(flown.returncode, 0, flown.stderr)
        self.assertIn(told, flown.stderr)
        doctor = nadir("doctor", run)
        self.assertEqual(doctor.returncode, 0, doctor.stderr)
        self.assertTrue(any(line.startswith("WARN") and told in line for line in doctor.stdout.splitlines()), doctor.stdout)

    def test_a_mission_without_fault_is_not_talked_about(self):
        for vehicle in (PLANE, COPTER):
            flown = nadir("fly", self.run_file(vehicle, "{north_m: 200, east_m: 0}"), "-o", self.out, "--dry-run", "--force")
            self.assertEqual(flown.returncode, 0, flown.stderr)
            self.assertNotIn("before the flight", flown.stderr)
            self.assertIn("missions: can be flown as planned", nadir("doctor", self.folder / "run.yaml").stdout)

    def test_waypoints_under_the_ground_are_refused(self):
        item = "{north_m: 1500, east_m: 0, height: -20 agl}"
        self.check_refused(self.run_file(PLANE, AHEAD, item), item, "leads 20.0 m under the ground")
        flown = nadir("fly", self.run_file(COPTER, "{north_m: 50, east_m: 0, height: -20 agl}"), "-o", self.out)
        self.assertNotEqual(flown.returncode, 0)
        self.assertIn("'vehicles.v.mission[0]': expected a height above the ground, found -20.0 m over it", flown.stderr)

    def test_climbs_out_of_reach_are_refused(self):
        item = "{north_m: 100, east_m: 0, height: 500 agl}"
        self.check_refused(self.run_file(PLANE, item), item, "asks for a climb of")
        item = "{north_m: 5, east_m: 0, height: 500 agl}"
        fast = "    flight: {speed_mps: 40, climb_mps: 40, acceleration_mps2: 8}\n    integration: {method: rk4, steps: 4}\n"
        self.check_refused(self.run_file(COPTER, item, more=fast), item, "lower its climb_mps")

    def test_turns_too_tight_in_wind_are_refused(self):
        corner = "{north_m: 400, east_m: 0, turn_radius_m: 80}"
        items = (corner, "{north_m: 400, east_m: 800}")
        still = nadir("fly", self.run_file(PLANE, *items), "-o", self.out, "--dry-run")
        self.assertEqual(still.returncode, 0, still.stderr)
        shutil.rmtree(self.out)
        windy = self.run_file(PLANE, *items, air="air: {wind: {from_deg: 225, speed_mps: 9}}\n")
        self.check_refused(windy, corner, "a turn of 80 m at 34.0 m/s over ground takes 56 degrees of bank")

    def test_multirotors_that_cannot_fly_against_the_wind_are_refused(self):
        item = "{north_m: 400, east_m: 0}"
        run = self.run_file(COPTER, item, more="    flight: {speed_mps: 12}\n    integration: {method: rk4, steps: 4}\n", air="air: {wind: {from_deg: 0, speed_mps: 10}}\n")
        self.check_refused(run, item, "12.0 m/s over ground along the course of 0 degrees take an airspeed of 22.0 m/s in a wind of 10.0 m/s")

    def test_a_battery_that_does_not_last_is_refused(self):
        item = "{north_m: 200, east_m: 0}"
        run = self.run_file(COPTER, item, more="    battery: {capacity_ah: 0.1}\n")
        self.check_refused(run, item, "the battery is empty after about")

    def test_cameras_that_leave_the_map_are_told(self):
        run = self.run_file(PLANE, "{north_m: 8000, east_m: 0}", duration_s=300, rate="0.1")
        self.check_told(run, "rgb leaves the map in about")

    def test_runs_that_do_not_fit_their_mission_are_told(self):
        self.check_told(self.run_file(PLANE, AHEAD, duration_s=200), "s of the run's 200 s: it circles on from there")
        self.check_told(self.run_file(COPTER, "{north_m: 50, east_m: 0}", duration_s=120), "it hovers on from there")
        text = (RUNS / "circuit.yaml").read_text().replace("../maps", str(MAPS)).replace("duration_s: 215", "duration_s: 100")
        (self.folder / "run.yaml").write_text(text)
        self.check_told(self.folder / "run.yaml", "the run ends after 100 s, and landing takes until about")

    def test_a_survey_of_a_multirotor_sees_its_area(self):
        run = self.run_file(COPTER, "survey: {rectangle: {north_m: 60, east_m: 40, length_m: 120, width_m: 60, heading_deg: 20}, sensor: rgb, forward_overlap: 0.6}",
                            duration_s=150, rate="survey", more="    flight: {speed_mps: 6}\n", air="air: {wind: {from_deg: 90, speed_mps: 3}}\n")
        flown = nadir("fly", run, "-o", self.out, "--dry-run", "--json")
        self.assertEqual(flown.returncode, 0, flown.stderr)
        self.assertEqual(flown.stderr, "")
        self.assertLess(json.loads(flown.stdout)["cross_track_m"], 1)
        self.assertIn("surveys in", nadir("doctor", run).stdout)

    def plan_pixels(self, items, **options):
        """Where the picture of a run that ends on its first leg has the colour of the plan."""
        done = nadir("fly", self.run_file(PLANE, *items, **options), "-o", self.out, "--dry-run", "--force")
        self.assertEqual(done.returncode, 0, done.stderr)
        picture = gdal.Open(str(self.out / "pictures/footprints_v_rgb.png")).ReadAsArray()[:3].astype(int)
        near = np.abs(picture - np.array([255, 224, 102])[:, None, None]).max(axis=0) < 25
        self.assertIn("data:image/png", (self.out / "report.html").read_text())
        return near

    def test_the_plan_is_dashed_in_the_picture_beyond_what_was_flown(self):
        near = self.plan_pixels([AHEAD, "{north_m: 800, east_m: 600}", "{north_m: -300, east_m: 600}"], duration_s=10)
        rows, columns = np.nonzero(near)
        self.assertGreater(len(rows), 400)
        # Down the eastern leg there are dashes and gaps: nine pixels and six, less or more what the stroke is wide
        eastern = near[:, columns.max() - 6:columns.max() + 1].any(axis=1)
        inside = eastern[np.nonzero(eastern)[0].min():np.nonzero(eastern)[0].max()]
        self.assertGreater(inside.mean(), 0.4)
        self.assertLess(inside.mean(), 0.9)
        changes = np.count_nonzero(inside[1:] != inside[:-1])
        self.assertAlmostEqual(2 * len(inside) / max(changes, 1), 15, delta=4)


if __name__ == "__main__":
    unittest.main()
