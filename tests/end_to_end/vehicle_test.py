"""Vehicles by parameter file, by the command: what is told of them before they fly, and that they fly again the same."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

NADIR = os.environ["NADIR_BIN"]
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
RUNS = SOURCE / "sim/demo/runs"
COPTER = """
kind: multirotor
mass_kg: 1.2
inertia_kgm2: {jxx: 0.01, jyy: 0.01, jzz: 0.018}
drive:
  electric:
    {diameter_m: 0.254, thrust: [0.1, -0.1, -0.12], torque: [0.005, 0.001, -0.014], kq_vspr: 0.0104,
     max_voltage_v: 14.8, resistance_ohm: 0.09, no_load_current_a: 0.6}
rotors:
  front right: {place_m: [0.16, 0.16, 0], turns: counterclockwise}
  rear right: {place_m: [-0.16, 0.16, 0], turns: clockwise}
  rear left: {place_m: [-0.16, -0.16, 0], turns: counterclockwise}
  front left: {place_m: [0.16, -0.16, 0], turns: clockwise}
drag: {coefficient: 1.5, area_m2: 0.02, induced_spm: 0.05}
battery: {cells: 4, capacity_ah: 5.2, resistance_ohm: 0.03}
"""


def nadir(*arguments):
    return subprocess.run([NADIR, *map(str, arguments)], capture_output=True, text=True, timeout=120)


class Vehicles(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nadir-vehicle-"))
        shutil.copy(RUNS / "rgb.yaml", self.folder)

    def tearDown(self):
        shutil.rmtree(self.folder)

    def run_file(self, demo, *replacements):
        text = (RUNS / f"{demo}.yaml").read_text()
        for old, new in (("../maps/", f"{SOURCE}/sim/demo/maps/"), ("rate_hz: 1}", "rate_hz: 0.05}"), *replacements):
            self.assertIn(old, text)
            text = text.replace(old, new)
        path = self.folder / "run.yaml"
        path.write_text(text)
        return path

    def copter(self, model, battery=""):
        return self.run_file("copter", ("model: multirotor", f"model: {model}"),
                             ("battery: {cells: 6, capacity_ah: 10}", battery))

    def test_a_copter_of_ones_own_flies_and_flies_again_from_what_was_written(self):
        (self.folder / "mine.yaml").write_text(COPTER)
        out, again = self.folder / "out", self.folder / "again"
        done = nadir("fly", self.copter("{file: mine.yaml, mass_kg: 1.3}", "battery: {charge_share: 0.9}"), "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("mass_kg: 1.3", (out / "run.yaml").read_text())
        (self.folder / "mine.yaml").unlink()  # what was written needs it no longer
        done = nadir("fly", out / "run.yaml", "-o", again)
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("run.yaml", "telemetry/copter/state.csv", "events.jsonl"):
            self.assertEqual((again / name).read_bytes(), (out / name).read_bytes(), name)

    def test_doctor_tells_what_is_unusual(self):
        done = nadir("doctor", self.copter("{base: multirotor, mass_kg: 10.5, rotors: {front left: {place_m: [0.13, -0.13, 0]}}}"))
        self.assertNotEqual(done.returncode, 0)  # too little for its mission, too
        for told in ("copter: little thrust: it cannot lift 1.5 times its weight", "copter: lopsided: it hovers at throttles", "asks for a climb of 5.0 m/s"):
            self.assertIn(told, done.stdout)
        self.assertNotIn("thrust", nadir("doctor", self.copter("multirotor")).stdout)
        done = nadir("doctor", self.copter("{base: multirotor, mass_kg: 16}"))
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("against a weight of", done.stderr)

    def test_all_faults_of_a_file_are_told_with_their_lines(self):
        lines = COPTER.replace("mass_kg: 1.2", "mass_kg: 1200000").replace("capacity_ah: 5.2", "capacity_ah: 5200")
        (self.folder / "mine.yaml").write_text(lines.replace("rear left", "rear right").replace("jzz", "jz"))
        done = nadir("fly", self.copter("{file: mine.yaml}"), "-o", self.folder / "out")
        self.assertNotEqual(done.returncode, 0)
        for told in ("mine.yaml:3: 'mass_kg': expected", "is it in grams?", "mine.yaml:4: expected the key 'inertia_kgm2.jzz'",
                     "unknown key 'inertia_kgm2.jz'; did you mean 'jzz'?", "mine.yaml:12: the key 'rotors.rear right' is there twice",
                     "mine.yaml:15: 'battery.capacity_ah'", "is it in mA h?"):
            self.assertIn(told, done.stderr)
        self.assertFalse((self.folder / "out").exists())

    def test_an_anaconda_flies_a_circuit_on_its_gear_and_a_junker_has_none(self):
        slower = (("takeoff: {clear_m: 20}", "takeoff: {clear_m: 20, rotate_mps: 11}"), ("yaw_deg: 0}\n    sensors", "yaw_deg: 0, airspeed_mps: 13}\n    sensors"), ("duration_s: 215", "duration_s: 352"))
        out = self.folder / "out"
        done = nadir("fly", self.run_file("circuit", ("model: aerosonde", "model: anaconda"), *slower), "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        events = (out / "events.jsonl").read_text()
        for event in ("lift-off", "touch-down", "landed"):
            self.assertIn(event, events)
        done = nadir("fly", self.run_file("circuit", ("model: aerosonde", "model: junker")), "-o", self.folder / "no")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("expected `gear:` with wheels or skids in its parameter file", done.stderr)


if __name__ == "__main__":
    unittest.main()
