"""The whole simulator by its command: what a flight leaves depends on its run file alone, and what cannot fly is told in one message."""
import ast
import hashlib
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import unittest

import jsonschema

NADIR = os.environ["NADIR_BIN"]
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
RUNS = SOURCE / "sim/demo/runs"
DURATION_S, RATE_HZ = 3, 5


def fly(*arguments):
    return subprocess.run([NADIR, "fly", *map(str, arguments)], capture_output=True, text=True, timeout=120)


def short_spain():
    """The demonstration over Spain, shortened, with small cameras and with paths that hold from anywhere."""
    text = (RUNS / "spain.yaml").read_text()
    for old, new in (("duration_s: 60", f"duration_s: {DURATION_S}"), ("rate_hz: 10", f"rate_hz: {RATE_HZ}"), ("../maps/", f"{SOURCE}/sim/demo/maps/")):
        assert old in text, old
        text = text.replace(old, new)
    return text


def northward(text, north_m):
    """The run with its aircraft this far north of the origin, and flying on to the north."""
    text, starts = re.subn(r"start: .*", f"start: {{north_m: {north_m}, east_m: -300, height: 1950 agl, yaw_deg: 0, airspeed_mps: 25}}", text)
    text, missions = re.subn(r"mission: .*", f"mission: [{{north_m: {north_m + 20_000}, east_m: -300}}]", text)
    assert (starts, missions) == (1, 1)
    return text


def small_camera(name):
    """A camera of the demonstration with a quarter of its pixels a side, and the same view."""
    text = (RUNS / name).read_text()
    width, height = (int(re.search(rf"image_{side}: (\d+)", text)[1]) for side in ("width", "height"))
    focal = float(re.search(r"data: \[([\d.]+)", text)[1]) / 4
    matrix = [focal, 0, width / 8 - 0.5, 0, focal, height / 8 - 0.5, 0, 0, 1]
    text = re.sub(r"data: \[.*\]", f"data: {matrix}", text, count=1)
    return text.replace(f"image_width: {width}", f"image_width: {width // 4}").replace(f"image_height: {height}", f"image_height: {height // 4}")


def hashes(folder, *patterns):
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for pattern in patterns for p in sorted(folder.glob(pattern)) if p.is_file()}


def records_of(folder):
    return [json.loads(line) for line in (folder / "frames.jsonl").read_text().splitlines()]


def truth_of(folder):
    """The records without what a clock measured."""
    return [{k: v for k, v in record.items() if k != "render_ms"} for record in records_of(folder)]


class Fly(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="nadir-fly-"))
        for name in ("rgb.yaml", "sar.yaml"):
            (cls.folder / name).write_text(small_camera(name))
        cls.run_file = cls.write("spain.yaml", short_spain() + "record: {truth_rows: true}\n")
        cls.first = cls.folder / "first"
        cls.done = fly(cls.run_file, "-o", cls.first, "--threads", 1, "--cache", "256MiB", "--json")
        assert cls.done.returncode == 0, cls.done.stderr

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def write(cls, name, text):
        path = cls.folder / name
        path.write_text(text)
        return path

    def assert_same_flight(self, other):
        patterns = ("frames/**/*", "telemetry/**/*", "camera/**/*", "truth_rows/**/*", "footprints.geojson")
        self.assertEqual(hashes(self.first, *patterns), hashes(other, *patterns))
        self.assertEqual(truth_of(self.first), truth_of(other))

    def assert_fault(self, done, *words):
        """One line on standard error, with these words, and an exit code that a shell takes for a failure and not a signal."""
        self.assertIn(done.returncode, (1, 2), done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("nadir fly: "), done.stderr)
        for word in words:
            self.assertIn(str(word), done.stderr)

    def test_frames_that_do_not_wait_for_tiles_say_so_and_verify_leaves_them_out(self):
        text, sensors = re.subn(r"(rgb: \{layer: )", r"rgb: {allow_coarse: true, layer: ", short_spain())
        self.assertEqual(sensors, 1)
        levels = self.folder / "levels.tif"
        made = subprocess.run([NADIR, "build", SOURCE / "sim/demo/maps/spain_s2.tif", "-o", levels, "--force", "--json"], capture_output=True, text=True, timeout=120)
        self.assertEqual(made.returncode, 0, made.stderr)
        text = text.replace(f"{SOURCE}/sim/demo/maps/spain_s2.tif", str(levels))
        folder = self.folder / "coarse"
        done = fly(self.write("coarse.yaml", text), "-o", folder, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("allow_coarse: true", (folder / "run.yaml").read_text())
        schema = json.loads((SOURCE / "sim/record/frames.schema.json").read_text())
        records = records_of(folder)
        for record in records:
            jsonschema.validate(record, schema)
        self.assertEqual({r["settings"]["coarse"] is None for r in records if r["sensor"] == "sar"}, {True}, "of the sensor that waits")
        rgb = [r for r in records if r["sensor"] == "rgb"]
        coarse = [r for r in rgb if r["settings"]["coarse"]["fraction"] > 0]
        self.assertEqual(coarse[0]["time_ns"], 0, "nothing was in memory then")
        self.assertEqual(coarse[0]["settings"]["coarse"]["fraction"], 1)
        self.assertEqual(json.loads(done.stdout)["coarse"], len(coarse))
        verified = subprocess.run([NADIR, "verify", str(folder), "--frames", "1000", "--json"], capture_output=True, text=True, timeout=120)
        self.assertEqual(verified.returncode, 0, verified.stderr + verified.stdout)
        said = json.loads(verified.stdout)
        self.assertEqual(said["frames_coarse"], len(coarse))
        self.assertEqual(said["frames_rendered"], len(records) - len(coarse))
        self.assertIn(f"{len(coarse)} frames cannot be rendered again", subprocess.run([NADIR, "verify", str(folder)], capture_output=True, text=True, timeout=120).stdout)

    def test_every_sensor_exposes_at_its_own_rate(self):
        times = {}
        for record in records_of(self.first):
            times.setdefault(record["sensor"], []).append(record["time_ns"])
        self.assertEqual(times["rgb"], [k * 10**9 // RATE_HZ for k in range(DURATION_S * RATE_HZ + 1)])
        self.assertEqual(times["sar"], [k * 10**9 // 2 for k in range(DURATION_S * 2 + 1)])
        self.assertEqual(json.loads(self.done.stdout)["frames"], len(records_of(self.first)))

    def test_records_follow_the_schema_and_list_every_frame(self):
        schema = json.loads((SOURCE / "sim/record/frames.schema.json").read_text())
        records = records_of(self.first)
        for record in records:
            jsonschema.validate(record, schema)
        listed = {record[key] for record in records for key in ("file", "mask_file") if record[key]}
        self.assertEqual(listed, set(hashes(self.first, "frames/**/*")))

    def test_verify_compares_footprints_with_the_records(self):
        def verify(folder):
            return subprocess.run([NADIR, "verify", str(folder), "--frames", "0"], capture_output=True, text=True, timeout=120)
        done = verify(self.first)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        other = self.folder / "altered"
        shutil.copytree(self.first, other)
        path = other / "footprints.geojson"
        collection = json.loads(path.read_text())
        collection["features"][1]["geometry"] = None
        lacking = collection["features"].pop(0)["properties"]
        path.write_text(json.dumps(collection))
        done = verify(other)
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"{lacking['vehicle']}/{lacking['sensor']} at {lacking['time_ns']} ns: footprints.geojson lacks it", done.stdout)
        self.assertIn("footprints.geojson has another footprint", done.stdout)
        path.unlink()
        done = verify(other)
        self.assertEqual(done.returncode, 1)
        self.assertIn("footprints.geojson", done.stderr)

    def test_threads_memory_and_pace_change_no_byte(self):
        for name, more in {"threads": ["--threads", 2], "memory": ["--threads", 2, "--cache", "8MiB"], "pace": ["--threads", 1, "--pace", 3]}.items():
            with self.subTest(name):
                done = fly(self.run_file, "-o", self.folder / name, "--json", *more)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assert_same_flight(self.folder / name)
                if name == "pace":
                    self.assertGreater(json.loads(done.stdout)["seconds"], DURATION_S / 3 - 0.01, "3 simulated seconds a second")

    def test_the_run_that_was_written_flies_the_same_again(self):
        moved = self.folder / "elsewhere"
        moved.mkdir()
        shutil.copy(self.first / "run.yaml", moved / "again.yaml")
        done = fly(moved / "again.yaml", "-o", moved / "out")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assert_same_flight(moved / "out")
        self.assertEqual((self.first / "run.yaml").read_bytes(), (moved / "out/run.yaml").read_bytes())

    def test_telemetry_is_whole_and_agrees_with_the_truth_of_frames(self):
        lines = (self.first / "telemetry/plane1/state.csv").read_text().splitlines()
        columns = lines[0].split(",")
        rows = [dict(zip(columns, map(float, line.split(",")))) for line in lines[1:]]
        self.assertEqual([row["time_ns"] for row in rows], [k * 20_000_000 for k in range(DURATION_S * 50 + 1)])
        at = {row["time_ns"]: row for row in rows}
        for record in records_of(self.first):
            row = at[record["time_ns"]]
            # The camera is at the vehicle's origin and looks along its down axis
            for key in ("lat_deg", "lon_deg", "yaw_deg", "pitch_deg", "roll_deg"):
                self.assertAlmostEqual(math.remainder(row[key] - record["pose"][key], 360), 0, places=9)  # 360 degrees are 0

    def test_truth_rows_hold_34_numbers_and_the_homography_of_the_records(self):
        for sensor in ("rgb", "sar"):
            records = [r for r in records_of(self.first) if r["sensor"] == sensor]
            rows = [[float(v) for v in line.split()] for line in (self.first / f"truth_rows/plane1/{sensor}.txt").read_text().splitlines()]
            self.assertEqual([len(row) for row in rows], [34] * len(records))
            for number, (row, record) in enumerate(zip(rows, records)):
                self.assertEqual(row[0], number)
                self.assertEqual([row[4], row[8], row[12]], record["pose"]["enu_m"])
                self.assertEqual(row[17:26], record["map_pixel_from_image_pixel"])
                corners = record["footprint"]["texel"]
                expected = [v - 0.5 for corner in (corners[i] for i in (0, 1, 3, 2)) for v in corner]
                self.assertEqual(row[26:], expected)

    def test_the_report_needs_nothing_from_elsewhere(self):
        html = (self.first / "report.html").read_text()
        self.assertEqual(re.findall(r"https?://[^\s\"'<]*", html), [])
        self.assertGreaterEqual(html.count("data:image/"), 4, "a contact sheet and the footprints of two sensors")
        for words in ("Flight report", "What the cameras saw", "left out"):
            self.assertIn(words, html)

    def test_a_rehearsal_renders_nothing_and_says_where_the_camera_leaves_the_map(self):
        out = self.folder / "rehearsal"
        text = short_spain()
        # From where the whole footprint still lies on the map, out over its northern edge: 40 m of the 70 that are flown
        text = northward(text, self.last_north_inside(text) - 40)
        done = fly(self.write("leaves.yaml", text), "-o", out, "--dry-run", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = json.loads(done.stdout)
        leaves = {e["sensor"]: e for e in summary["leaves_map"]}
        self.assertGreater(leaves["plane1/rgb"]["from_ns"], 0, "it begins on the map")
        self.assertEqual(leaves["plane1/rgb"]["to_ns"], DURATION_S * 10**9, "and does not come back")
        self.assertEqual((summary["frames"], summary["rejected"]), (0, 0))
        self.assertEqual(hashes(out, "frames*", "frames/**/*", "telemetry/**/*"), {}, "a rehearsal is no dataset")
        html = (out / "report.html").read_text()
        self.assertRegex(html, r"plane1/rgb: \d+ exposures from \d")
        said = fly(self.folder / "leaves.yaml", "-o", out, "--dry-run", "--force")
        self.assertRegex(said.stdout, r"plane1/rgb leaves the map from \d")

        # What the rehearsal says is what the flight finds
        done = fly(self.folder / "leaves.yaml", "-o", self.folder / "leaves")
        self.assertEqual(done.returncode, 0, done.stderr)
        off = [r["time_ns"] for r in records_of(self.folder / "leaves") if r["sensor"] == "rgb" and any(not 0 <= v <= 1 for corner in r["footprint"]["uv"] for v in corner)]
        self.assertEqual((min(off), max(off), len(off)), tuple(leaves["plane1/rgb"][k] for k in ("from_ns", "to_ns", "exposures")))

    def test_a_flight_forced_over_an_earlier_one_leaves_nothing_of_it(self):
        out = self.folder / "replaced"
        shutil.copytree(self.first, out)
        text = short_spain().replace(f"duration_s: {DURATION_S}", "duration_s: 0.1") + "record: {telemetry: none}\n"
        done = fly(self.write("bare.yaml", text), "-o", out, "--force")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(hashes(out, "telemetry/**/*", "truth_rows/**/*"), {})
        self.assertEqual(set(hashes(out, "frames/**/*")), {r["file"] for r in records_of(out)})

    def last_north_inside(self, text):
        """The largest start, to 10 m, from which the first exposure lies on the map whole."""
        low, high = 0, 11000  # metres: the map reaches less far
        while high - low > 10:
            middle = (low + high) // 2
            run = self.write("probe.yaml", northward(text, middle).replace(f"duration_s: {DURATION_S}", "duration_s: 0.01"))
            done = fly(run, "-o", self.folder / "probe", "--dry-run", "--json", "--force")
            self.assertEqual(done.returncode, 0, done.stderr)
            outside = any(e["sensor"] == "plane1/rgb" for e in json.loads(done.stdout)["leaves_map"])
            low, high = (low, middle) if outside else (middle, high)
        self.assertGreater(low, 0)
        self.assertLess(high, 11000)
        return low

    def test_rejected_exposures_are_recorded_as_such(self):
        text = short_spain().replace("range: [0, 2500]", "range: [0, 2500], off_map: reject")
        text = northward(text, 200_000).replace(f"duration_s: {DURATION_S}", "duration_s: 0.4")
        out = self.folder / "rejected"
        done = fly(self.write("rejected.yaml", text), "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("3 exposures were rejected", done.stdout)
        schema = json.loads((SOURCE / "sim/record/frames.schema.json").read_text())
        records = [r for r in records_of(out) if r["sensor"] == "rgb"]
        self.assertEqual(len(records), 3)
        for record in records:
            jsonschema.validate(record, schema)
            self.assertTrue(record["rejected"])
        self.assertEqual(hashes(out, "frames/plane1/rgb/*"), {})

    def test_what_cannot_fly_is_told_in_one_message(self):
        good, out = short_spain(), self.folder / "never"

        def fault(name, old, new, *words):
            self.assertIn(old, good)
            path = self.write(name, good.replace(old, new))
            self.assert_fault(fly(path, "-o", out), *words)
            self.assertFalse(out.exists(), "nothing is left of a run that did not begin")

        line = 1 + good.splitlines().index(next(row for row in good.splitlines() if "turn_radius_m" in row))
        fault("key.yaml", "turn_radius_m", "turn_raduis_m", f"key.yaml:{line}: unknown key 'vehicles.plane1.turn_raduis_m'; did you mean 'turn_radius_m'?")
        fault("map.yaml", "spain_s1.tif", "spain_s9.tif", "layer sar", "spain_s9.tif", "no such file")
        fault("fast.yaml", "airspeed_mps: 25", "airspeed_mps: 60", "vehicle plane1", "60")
        fault("camera.yaml", "camera: sar.yaml", "camera: gone.yaml", "gone.yaml", "no such file")
        self.assert_fault(fly(self.folder / "nowhere.yaml", "-o", out), "nowhere.yaml", "no such file")
        self.assert_fault(fly(self.run_file, "-o", out, "--cache", "much"), "--cache", "'much'")
        self.assert_fault(fly(self.run_file, "-o", out, "--pace", -1), "--pace")

    def test_an_output_folder_in_use_is_left_alone(self):
        mine = self.folder / "mine"
        mine.mkdir()
        (mine / "notes.txt").write_text("keep me")
        self.assert_fault(fly(self.run_file, "-o", mine), mine, "is there already", "--force")
        self.assertEqual([p.name for p in mine.iterdir()], ["notes.txt"])

    def test_binary_telemetry_has_the_numbers_of_text(self):
        tables = []
        for kind in ("csv", "npy"):
            text = short_spain().replace("sensors:", "sensors: {}").split("      rgb:")[0] + f"record: {{frames: false, telemetry: {kind}, telemetry_rate_hz: 33}}\n"
            out = self.folder / kind
            done = fly(self.write(f"{kind}.yaml", text), "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            data = (out / f"telemetry/plane1/state.{kind}").read_bytes()
            if kind == "csv":
                header, *lines = data.decode().splitlines()
                tables.append((header.split(","), [[float(v) for v in line.split(",")] for line in lines]))
                continue
            self.assertEqual(data[:8], b"\x93NUMPY\x01\x00")
            (length,) = struct.unpack("<H", data[8:10])
            self.assertEqual((10 + length) % 64, 0)
            described = ast.literal_eval(data[10 : 10 + length].decode())
            names, types = zip(*described["descr"])
            self.assertEqual(types, ("<i8",) + ("<f8",) * (len(names) - 1))
            rows = [list(map(float, row)) for row in struct.iter_unpack("<q" + "d" * (len(names) - 1), data[10 + length :])]
            self.assertEqual(described["shape"], (len(rows),))
            tables.append((list(names), rows))
        self.assertEqual(len(tables[0][1]), DURATION_S * 33 + 1)
        self.assertEqual(tables[0], tables[1])

    def test_many_flights_leave_a_table_and_a_report(self):
        run = self.write("many.yaml", short_spain())
        for threads in (1, 2):
            done = fly(run, "-o", self.folder / f"many{threads}", "--flights", 3, "--threads", threads, "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual({k: json.loads(done.stdout)[k] for k in ("flights", "ended_early", "simulated_seconds")}, {"flights": 3, "ended_early": 0, "simulated_seconds": 3 * DURATION_S})
        tables = [(self.folder / f"many{threads}/flights.csv").read_text() for threads in (1, 2)]
        self.assertEqual(tables[0], tables[1])
        rows = tables[0].splitlines()
        self.assertEqual([row.split(",")[0] for row in rows], ["seed", "7", "8", "9"])
        self.assertIn("<svg", (self.folder / "many1/report.html").read_text())
        refused = fly(run, "-o", self.folder / "many1", "--flights", 3)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("--force", refused.stderr)

    def test_a_pose_file_shorter_than_the_run_is_told_before_it_begins(self):
        text = (RUNS / "kampala.yaml").read_text().replace("../maps/", f"{SOURCE}/sim/demo/maps/").replace("kampala.csv", str(RUNS / "kampala.csv"))
        out = self.folder / "kampala"
        self.assert_fault(fly(self.write("long.yaml", text.replace("duration_s: 23.5", "duration_s: 60")), "-o", out), "vehicle copter", "kampala.csv", "from 0 s to 23.5 s", "60 s", "duration_s")
        self.assertFalse(out.exists())
        done = fly(self.write("kampala.yaml", text.replace("duration_s: 23.5", "duration_s: 1")), "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        header, row = (out / "telemetry/copter/state.csv").read_text().splitlines()[:2]
        self.assertEqual(row.count(","), header.count(","), "a column for all that a flown vehicle would know")


if __name__ == "__main__":
    unittest.main()
