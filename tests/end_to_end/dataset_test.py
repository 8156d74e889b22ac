"""The command from maps to a dataset: what it writes follows the schemas and does not depend on threads or memory."""
import csv
import filecmp
import hashlib
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import jsonschema
from osgeo import gdal, ogr

NADIR = os.environ["NADIR_BIN"]
gdal.UseExceptions()
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
MAPS = SOURCE / "sim/demo/maps"
RUNS = SOURCE / "sim/demo/runs"


def nadir(*arguments):
    return subprocess.run([NADIR, *map(str, arguments)], capture_output=True, text=True, timeout=120)


def spain(out, *more):
    return nadir("render", "--map", MAPS / "spain_s2.tif", "--name", "optical", "--bands", "B4,B3,B2", "--output", "uint8", "--range", "0,2500",
                 "--map", MAPS / "spain_s1.tif", "--name", "radar", "--bands", "VV",
                 "--camera", RUNS / "rgb.yaml", "--poses", RUNS / "spain.csv", "--first", 3, "-o", out, "--no-pictures", *more)


def frames_of(folder):
    return {p.relative_to(folder): hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.glob("frames/**/*.*"))}


def records_of(folder):
    return [json.loads(line) for line in (folder / "frames.jsonl").read_text().splitlines()]


class Dataset(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.out = pathlib.Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def test_records_follow_the_schema(self):
        schema = json.loads((SOURCE / "sim/record/frames.schema.json").read_text())
        jsonschema.Draft7Validator.check_schema(schema)
        done = spain(self.out / "a")
        self.assertEqual(done.returncode, 0, done.stderr)
        records = records_of(self.out / "a")
        self.assertEqual([(r["sensor"], r["time_ns"]) for r in records],
                         [(s, t * 5_000_000_000) for t in range(3) for s in ("optical", "radar")])
        for record in records:
            jsonschema.validate(record, schema)
            self.assertTrue((self.out / "a" / record["file"]).is_file())
        broken = dict(records[0], time_ns="0")
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.validate(broken, schema)

    def test_footprints_are_geojson_that_gdal_opens(self):
        done = spain(self.out / "a")
        self.assertEqual(done.returncode, 0, done.stderr)
        path = self.out / "a/footprints.geojson"
        schema = json.loads((SOURCE / "sim/record/footprints.schema.json").read_text())
        jsonschema.Draft7Validator.check_schema(schema)
        collection = json.loads(path.read_text())
        jsonschema.validate(collection, schema)
        records = records_of(self.out / "a")
        self.assertEqual([f["geometry"] for f in collection["features"]], [r["footprint"]["geometry"] for r in records])
        opened = gdal.OpenEx(str(path), gdal.OF_VECTOR)
        layer = opened.GetLayer()
        self.assertEqual(layer.GetFeatureCount(), len(records))
        for feature, record in zip(layer, records):
            area = feature.GetGeometryRef()
            self.assertTrue(area.IsValid())
            self.assertEqual(feature["file"], record["file"])
            camera = ogr.Geometry(ogr.wkbPoint)
            camera.AddPoint_2D(record["pose"]["lon_deg"], record["pose"]["lat_deg"])
            self.assertTrue(area.Contains(camera), "it looks down")

    def test_footprints_across_the_antimeridian_around_poles_and_from_orbit(self):
        camera = self.out / "wide.yaml"
        camera.write_text("image_width: 64\nimage_height: 64\ncamera_name: wide\n"
                          "camera_matrix: {rows: 3, cols: 3, data: [30, 0, 31.5, 0, 30, 31.5, 0, 0, 1]}\n")
        poses = self.out / "poses.csv"
        # Across 180; around each pole; the Earth from afar, on whose disc both 180 and a pole lie
        places = [(10, 179.9, 100e3), (89.9, 20, 100e3), (-89.9, 20, 100e3), (60, 170, 36e6), (0, 20, 100e3)]
        poses.write_text("t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n" +
                         "".join(f"{i},{lat},{lon},{height},30,0,0\n" for i, (lat, lon, height) in enumerate(places)))
        done = nadir("render", "--map", MAPS / "naip_2010.tif", "--bands", "1", "--camera", camera, "--poses", poses,
                     "--surface", "ellipsoid", "-o", self.out / "a", "--no-pictures", "--off-map", "mask")
        self.assertEqual(done.returncode, 0, done.stderr)
        schema = json.loads((SOURCE / "sim/record/frames.schema.json").read_text())
        for record in records_of(self.out / "a"):
            jsonschema.validate(record, schema)
        opened = gdal.OpenEx(str(self.out / "a/footprints.geojson"), gdal.OF_VECTOR)
        areas = [feature.GetGeometryRef().Clone() for feature in opened.GetLayer()]
        self.assertEqual([area.GetGeometryName() for area in areas], ["MULTIPOLYGON", "POLYGON", "POLYGON", "POLYGON", "POLYGON"])
        for area, (lat, lon, _) in zip(areas, places):
            self.assertTrue(area.IsValid())
            camera_place = ogr.Geometry(ogr.wkbPoint)
            camera_place.AddPoint_2D(lon, lat)
            self.assertTrue(area.Contains(camera_place))
        west, east, south, north = areas[0].GetEnvelope()
        self.assertEqual((west, east), (-180, 180))
        self.assertLess(areas[0].GetArea(), 10)
        self.assertEqual([areas[i].GetEnvelope()[3 if i != 2 else 2] for i in (1, 2, 3)], [90, -90, 90])

    def test_layers_of_one_pose_agree_on_geometry(self):
        self.assertEqual(spain(self.out / "a").returncode, 0)
        optical, radar = records_of(self.out / "a")[:2]
        for key in ("pose", "footprint", "map_pixel_from_image_pixel", "camera_matrix"):
            self.assertEqual(optical[key], radar[key], key)

    def test_truth_holds_the_pose_that_was_asked_for(self):
        self.assertEqual(spain(self.out / "a", "--ground-height", "100").returncode, 0)
        rows = list(csv.DictReader(line for line in (RUNS / "spain.csv").read_text().splitlines() if not line.startswith("#")))
        for row, record in zip(rows, records_of(self.out / "a")[::2]):
            for key in ("lat_deg", "lon_deg", "yaw_deg", "pitch_deg", "roll_deg"):
                self.assertAlmostEqual(float(row[key]), record["pose"][key], places=8)
            self.assertAlmostEqual(record["pose"]["height_ellipsoid_m"], 2050, places=5)  # 1950 above a ground at 100

    def test_threads_and_memory_do_not_change_a_byte(self):
        for name, more in {"a": ["--threads", 1], "b": ["--threads", 3], "c": ["--threads", 2, "--cache", "3MiB"]}.items():
            done = spain(self.out / name, *more)
            self.assertEqual(done.returncode, 0, done.stderr)
        for other in ("b", "c"):
            self.assertEqual(frames_of(self.out / "a"), frames_of(self.out / other))
            for one, two in zip(records_of(self.out / "a"), records_of(self.out / other)):
                one.pop("render_ms"), two.pop("render_ms")
                self.assertEqual(one, two)

    def test_frames_in_bands_are_the_frames_and_take_the_memory_of_a_band(self):
        side = 6000
        (self.out / "large.yaml").write_text(
            f"image_width: {side}\nimage_height: {side}\ncamera_name: large\ndistortion_model: plumb_bob\n"
            f"camera_matrix: {{rows: 3, cols: 3, data: [{side}, 0, {side / 2 - 0.5}, 0, {side}, {side / 2 - 0.5}, 0, 0, 1]}}\n"
            "distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0, 0, 0, 0]}\n")
        (self.out / "one.csv").write_text("t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n0,0.3508737,32.5947189,250,30,10,0\n")
        peak_kib = {}
        for name, memory in (("whole", "1GiB"), ("bands", "4MiB")):
            arguments = [NADIR, "render", "--map", MAPS / "kampala.tif", "--camera", self.out / "large.yaml", "--poses", self.out / "one.csv",
                         "-o", self.out / name, "--frame-memory", memory, "--no-pictures", "--json"]
            with open(self.out / f"{name}.json", "w") as summary:
                child = subprocess.Popen(list(map(str, arguments)), stdout=summary)
                _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            self.assertEqual(child.returncode, 0)
            self.assertEqual(json.loads((self.out / f"{name}.json").read_text())["in_bands"], int(name == "bands"))
            peak_kib[name] = usage.ru_maxrss
        self.assertEqual(frames_of(self.out / "whole"), frames_of(self.out / "bands"))
        self.assertEqual(len(frames_of(self.out / "bands")), 2, "an image and its mask")
        whole, bands = ({k: v for k, v in records_of(self.out / name)[0].items() if k != "render_ms"} for name in ("whole", "bands"))
        self.assertEqual(whole, bands)
        frame_kib = side * side * 4 // 1024  # three bands and validity
        self.assertLess(peak_kib["bands"], peak_kib["whole"] - frame_kib * 3 // 4)

    def test_frames_in_bands_have_no_truth_planes_and_wait(self):
        for option in ("--truth-planes", "--allow-coarse"):
            done = spain(self.out / "a", "--frame-memory", "1MiB", option)
            self.assertEqual(done.returncode, 1)
            self.assertIn(option, done.stderr)
            self.assertIn("--frame-memory", done.stderr)
            self.assertFalse((self.out / "a").exists())

    def test_camera_file_comes_back_as_it_went_in(self):
        self.assertEqual(spain(self.out / "a").returncode, 0)
        written = self.out / "a/camera/vehicle/rgb.yaml"
        done = nadir("render", "--map", MAPS / "naip_2010.tif", "--bands", "1,2,3", "--camera", written, "--poses", RUNS / "naip.csv", "--first", 1, "-o", self.out / "b", "--no-pictures")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(filecmp.cmp(written, self.out / "b/camera/vehicle/rgb.yaml", shallow=False))

    def test_pictures_are_made(self):
        done = nadir("render", "--map", MAPS / "naip_2010.tif", "--name", "eo", "--bands", "1,2,3", "--camera", RUNS / "rgb.yaml", "--poses", RUNS / "naip.csv",
                     "--first", 2, "-o", self.out / "a")
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("contact_eo.png", "footprints_eo.png"):
            self.assertEqual((self.out / "a" / name).read_bytes()[:4], b"\x89PNG")

    def test_a_lens_over_the_curved_earth(self):
        camera = self.out / "wide.yaml"
        camera.write_text((RUNS / "rgb.yaml").read_text().replace("[0, 0, 0, 0, 0]", "[-0.2, 0.05, 0.001, -0.001, 0]"))
        for name, more in {"a": ["--threads", 1], "b": ["--threads", 3, "--no-pictures"]}.items():
            done = nadir("render", "--map", MAPS / "naip_2010.tif", "--name", "eo", "--bands", "1,2,3", "--camera", camera, "--poses", RUNS / "naip.csv",
                         "--surface", "ellipsoid", "--first", 2, "-o", self.out / name, "--explain", "--json", *more)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(frames_of(self.out / "a"), frames_of(self.out / "b"))
        explanation = json.loads(done.stdout)["explain"]
        self.assertTrue(any(" quadratics" in line for line in explanation["done"]), explanation)
        self.assertFalse(any("undistortion" in line for line in explanation["left_out"]), explanation)
        for record in records_of(self.out / "a"):
            self.assertEqual(record["distortion_model"], "plumb_bob")
            self.assertEqual(record["distortion"], [-0.2, 0.05, 0.001, -0.001, 0])
            self.assertIsNone(record["map_pixel_from_image_pixel"], "no homography is exact")
            self.assertGreater(record["valid_fraction"], 0.9)
        self.assertTrue((self.out / "a" / "footprints_eo.png").is_file())

    def test_explain_says_what_was_left_out(self):
        done = spain(self.out / "a", "--explain", "--json")
        explanation = json.loads(done.stdout)["explain"]
        self.assertTrue(any("mapping shared" in line for line in explanation["done"]), explanation)
        self.assertTrue(any("10 bands: not asked for" in line for line in explanation["left_out"]), explanation)

    def test_explain_tells_the_plan_as_data(self):
        done = spain(self.out / "a", "--explain", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(done.stdout)
        plan, frame = told["explain"], records_of(self.out / "a")[0]
        for layer in plan["layers"]:
            self.assertEqual(layer["pixels_sampled"] + layer["pixels_no_ground"] + layer["pixels_off_map"], layer["pixels"])
            self.assertEqual(layer["pixels"], frame["width"] * frame["height"])
            self.assertLessEqual(layer["mapping"]["error_px"], layer["mapping"]["tolerance_px"])
            self.assertTrue(layer["levels"])
        self.assertEqual([layer["mapping"]["shared"] for layer in plan["layers"]][0], False)
        self.assertEqual(sum(layer["cells"] for layer in plan["layers"]), plan["frame"]["cells"])
        self.assertIsNone(plan["exposure"])
        for times in (plan["times"], told["median_times"]):
            shares = [value for key, value in times.items() if key.endswith("_share")]
            self.assertEqual(len(shares), 6)
            self.assertTrue(all(share > 0 for share in shares), times)
        self.assertLessEqual(sum(v for k, v in plan["times"].items() if k.endswith("_share")), 1 + 1e-9)
        self.assertNotIn("planning", (self.out / "a" / "frames.jsonl").read_text(), "times are for people")
        lines = spain(self.out / "b", "--explain").stdout
        self.assertRegex(lines, r"the first frame, .*planning [0-9.e-]+ ms \([0-9.]+ %\)")


if __name__ == "__main__":
    unittest.main()
