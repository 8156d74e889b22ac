"""Exposures of a camera in motion, from the command and the run file to records that a schema and `nadir verify` hold to."""
import json
import unittest

import numpy as np
from osgeo import gdal

from kampala import DEGREES_PER_M, LAT, LON, MAP, OverKampala, nadir, records_of

gdal.UseExceptions()


class Motion(OverKampala):
    def setUp(self):
        super().setUp()
        # To the north at 20 m/s, turning
        self.rows = [f"{t},{LAT + t * 20 * DEGREES_PER_M:.9f},{LON},70 agl,{15 * t},0,0" for t in range(3)]
        self.write_poses(self.rows)

    def picture(self, folder, record):
        return gdal.Open(str(folder / record["file"])).ReadAsArray().astype(float)

    def test_a_row_of_a_rolling_shutter_is_that_of_a_frame_at_its_time(self):
        self.assertEqual(self.render("rolling", "--readout", 0.4).returncode, 0)
        rolling = records_of(self.out / "rolling")
        self.assertEqual(rolling[1]["exposure"]["readout_s"], 0.4)
        # What the middle of row 45 (a quarter of the way down) sees, 0.1 s before the stamp, the middle row of a frame then does
        t = round(1 + 0.4 * (45.5 / 180 - 0.5), 9)
        self.write_poses([f"0.5,{LAT + 0.5 * 20 * DEGREES_PER_M:.9f},{LON},70 agl,7.5,0,0",
                          f"{t},{LAT + t * 20 * DEGREES_PER_M:.9f},{LON},70 agl,{15 * t},0,0"])
        self.assertEqual(self.render("still").returncode, 0)
        still = records_of(self.out / "still")
        self.assertIsNone(still[1]["exposure"])
        found = self.picture(self.out / "rolling", rolling[1])[:, 45]
        right = self.picture(self.out / "still", still[1])[:, 45]
        self.assertLess(np.abs(found - right).mean(), 1.5)
        other = self.picture(self.out / "rolling", rolling[1])[:, 46]
        self.assertGreater(np.abs(other - right).mean(), 3, "the picture is not so smooth that any row would do")

    def test_blur_is_recorded_and_smooths_along_the_motion(self):
        self.assertEqual(self.render("blur", "--exposure", 0.1).returncode, 0)
        self.assertEqual(self.render("sharp").returncode, 0)
        blurred, sharp = (records_of(self.out / name) for name in ("blur", "sharp"))
        exposure = blurred[0]["exposure"]
        # 2 m of 0.28 m pixels, and at the image's ends 1.5 degrees of turn more
        self.assertTrue(7 < exposure["motion_px"] < 14, exposure)
        self.assertEqual(exposure["poses"], int(np.ceil(exposure["motion_px"] / 2)))
        way = np.array(exposure["end"]["ecef_m"]) - np.array(exposure["start"]["ecef_m"])
        self.assertAlmostEqual(np.linalg.norm(way), 2, places=2)
        # The nose is up: rows differ less, columns hardly
        along = lambda p: np.abs(np.diff(p, axis=1))[:, :, 120:200].mean()
        across = lambda p: np.abs(np.diff(p, axis=2))[:, :, 120:200].mean()
        a, b = self.picture(self.out / "sharp", sharp[0]), self.picture(self.out / "blur", blurred[0])
        self.assertLess(along(b), 0.5 * along(a))
        self.assertGreater(across(b), along(b))
        self.assertEqual(sharp[0]["pose"]["ecef_m"], blurred[0]["pose"]["ecef_m"])

    def test_a_flight_keeps_its_shutter_and_verifies(self):
        (self.out / "run.yaml").write_text(f"""duration_s: 1
scene:
  layers: {{eo: {{map: {MAP}, bands: [1, 2, 3]}}}}
vehicles:
  copter: {{model: poses, poses: poses.csv, sensors: {{rgb: {{layer: eo, camera: small.yaml, rate_hz: 2, exposure_s: 0.02, readout_s: 0.03}}}}}}
  plane: {{start: {{height: 70 agl}}, sensors: {{rgb: {{layer: eo, camera: small.yaml, rate_hz: 2, exposure_s: 0.02}}}}}}
record: {{report: false}}
""")
        flight = self.out / "flight"
        done = nadir("fly", self.out / "run.yaml", "-o", flight)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("exposure_s: 0.02, readout_s: 0.03", (flight / "run.yaml").read_text())
        records = {(r["vehicle"], r["time_ns"]): r["exposure"] for r in records_of(flight)}
        for vehicle, speed, duration in (("copter", 20, 0.05), ("plane", 25, 0.02)):
            exposure = records[vehicle, 500000000]
            way = np.linalg.norm(np.array(exposure["end"]["ecef_m"]) - np.array(exposure["start"]["ecef_m"]))
            self.assertAlmostEqual(way, speed * duration, delta=0.02 * speed * duration)
        said = nadir("verify", flight, "--json")
        self.assertEqual(said.returncode, 0, said.stderr + said.stdout)
        self.assertGreater(json.loads(said.stdout)["frames_rendered"], 3)

    def test_faults_are_said(self):
        done = self.render("a", "--exposure", -1)
        self.assertEqual(done.returncode, 1)
        self.assertIn("exposure: expected seconds in [0, 3600], found -1", done.stderr)
        self.write_poses(self.rows[:1])
        done = self.render("a", "--readout", 0.1)
        self.assertEqual(done.returncode, 1)
        self.assertIn("at least two poses", done.stderr)
        (self.out / "run.yaml").write_text(f"""duration_s: 1
scene: {{layers: {{eo: {{map: {MAP}}}}}}}
vehicles:
  copter: {{model: poses, poses: poses.csv, sensors: {{rgb: {{layer: eo, camera: small.yaml, rate_hz: 2, exposure_s: -3}}}}}}
""")
        done = nadir("fly", self.out / "run.yaml", "-o", self.out / "flight")
        self.assertEqual(done.returncode, 1)
        self.assertIn("run.yaml:4:", done.stderr)
        self.assertIn("exposure", done.stderr)


if __name__ == "__main__":
    unittest.main()
