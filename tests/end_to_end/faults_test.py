"""What goes wrong around a run, and what nadir says of it.

Each fault gives one message on standard error that says what, where and what to do, and an exit code that is not 0.
Needs the environment variable NADIR_BIN: the nadir command, beside it the programs and the image module that it uses.
"""
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from osgeo import gdal

NADIR = os.environ["NADIR_BIN"]
gdal.UseExceptions()
FILES = pathlib.Path(__file__).resolve().parent.parent / "data" / "awkward"
CAMERA = """image_width: {width}
image_height: 64
camera_name: down
camera_matrix: {{rows: 3, cols: 3, data: [64, 0, 31.5, 0, 64, 31.5, 0, 0, 1]}}
"""
HEADER = "t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n"


def run(*arguments, file_bytes=None):
    """Runs nadir. With `file_bytes` no file grows beyond that: to the program, a disk that is full."""
    def limit():
        if file_bytes is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))
    return subprocess.run([NADIR, *map(str, arguments)], capture_output=True, text=True, timeout=60, preexec_fn=limit)


class Faults(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="nadir-faults-"))
        cls.map = FILES / "pixel_is_point__byte_point.tif"  # 20 x 20 texels of 60 m
        center = json.loads(run("info", "--json", cls.map).stdout)["center"]
        cls.place = (center["lat_deg"], center["lon_deg"])

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def file(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def poses(self, lat=None, frames=6):
        rows = [f"{i},{self.place[0] if lat is None else lat},{self.place[1]},1200,0,0,0\n" for i in range(frames)]
        return self.file("poses.csv", HEADER + "".join(rows))

    def render(self, *more, map=None, camera=None, poses=None, out="--no-output", file_bytes=None):
        output = [out] if out == "--no-output" else ["-o", out]
        return run("render", "--map", map or self.map, *more, "--camera", camera or self.file("camera.yaml", CAMERA.format(width=64)),
                   "--poses", poses or self.poses(), *output, file_bytes=file_bytes)

    def assert_fault(self, done, *words):
        """One line on standard error, with these words, and an exit code that a shell takes for a failure and not a signal."""
        self.assertIn(done.returncode, (1, 2), done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("nadir"), done.stderr)
        for word in words:
            self.assertIn(str(word), done.stderr)

    def records(self, folder):
        """The records of a dataset; fails where one is cut short, or lists an image that is not whole."""
        records = [json.loads(line) for line in (folder / "frames.jsonl").read_text().splitlines()]
        for record in records:
            if record["file"]:
                self.assertEqual((folder / record["file"]).read_bytes()[-8:-4], b"IEND", record["file"])
        return records

    def test_a_good_run_says_nothing_on_standard_error(self):
        folder = self.folder / "good"
        done = self.render(out=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("nadir ", done.stderr)  # no note; progress there may be
        self.assertEqual([r["valid_fraction"] for r in self.records(folder)], [1.0] * 6)

    def test_files_that_are_not_there_or_are_folders(self):
        gone = self.folder / "gone"
        self.assert_fault(run("info", gone), gone, "no such file")
        self.assert_fault(run("info", self.folder), self.folder, "found a folder", "nadir build")
        self.assert_fault(run("info", ""), "path of a raster")
        self.assert_fault(self.render(map=gone), gone, "no such file")
        self.assert_fault(self.render(camera=gone), gone, "no such file")
        self.assert_fault(self.render(poses=gone), gone, "no such file")
        self.assert_fault(self.render(camera=self.folder), self.folder, "found a folder")
        self.assert_fault(self.render(poses=self.folder), self.folder, "found a folder")

    def test_words_that_are_not_known(self):
        self.assert_fault(run("rendr"), "'rendr'", "'render'")
        self.assert_fault(run("info", "--chek", self.map), "'--chek'", "'--check'")
        self.assert_fault(self.render("--qualty", "best"), "'--qualty'", "'--quality'")
        self.assert_fault(self.render("--quality", "bset"), "'bset'", "'best'")
        self.assert_fault(self.render("--bands", "VV"), self.map, "'VV'", "bands 1 to 1")
        camera = self.file("key.yaml", CAMERA.format(width=64).replace("camera_name", "camera_nmae"))
        self.assert_fault(self.render(camera=camera), f"{camera}:3", "'camera_nmae'", "'camera_name'")
        poses = self.file("column.csv", HEADER.replace("yaw_deg", "yaw_degg") + "0,0,0,1,0,0,0\n")
        self.assert_fault(self.render(poses=poses), f"{poses}:1", "'yaw_degg'", "'yaw_deg'")

    def test_numbers_that_cannot_be(self):
        for width in (0, 65537):
            camera = self.file("size.yaml", CAMERA.format(width=width))
            self.assert_fault(self.render(camera=camera), camera, "1 to 65536 pixels", width)
        for column in (1, 3, 4):
            fields = ["0", "0", "0", "1", "0", "0", "0"]
            fields[column] = "nan"
            poses = self.file("nan.csv", HEADER + ",".join(fields) + "\n")
            self.assert_fault(self.render(poses=poses), f"{poses}:2", HEADER.strip().split(",")[column], "'nan'")
        for text in ("", HEADER):
            poses = self.file("empty.csv", text)
            self.assert_fault(self.render(poses=poses), poses, "expected poses, found none")
        self.assert_fault(self.render("--threads", "-2"), "--threads", "0 to 1024")
        self.assert_fault(self.render("--first", "-1"), "--first", "-1")
        self.assert_fault(self.render("--cache", "-5"), "--cache", "256MiB")
        self.assert_fault(self.render("--cache", "1K"), self.map, "allow more memory with --cache")

    def test_an_option_of_a_map_before_any_map(self):
        done = run("render", "--bands", "1", "--map", self.map, "--camera", "c", "--poses", "p", "--no-output")
        self.assert_fault(done, "--bands", "after the --map")

    def test_names_that_lead_out_of_the_folder(self):
        self.assert_fault(self.render("--name", "../x"), "--name '../x'")
        self.assert_fault(self.render("--vehicle", ".."), "--vehicle '..'")
        camera = self.file("name.yaml", CAMERA.format(width=64).replace("down", "../../x"))
        self.assert_fault(self.render(camera=camera), camera, "camera_name '../../x'")

    def test_maps_that_cannot_be_rendered(self):
        for name, words in (("geotransform__byte_nogeoref", "-a_srs CRS -a_ullr"), ("gcp_rpc__byte_gcp", "gdalwarp"), ("complex__cint16", "magnitude")):
            path = FILES / (name + ".tif")
            self.assert_fault(self.render(map=path), path, words)
            self.assertEqual(run("info", path).returncode, 0, "it can still be described")

    def test_damaged_tiles_name_file_level_and_texels(self):
        path, folder = FILES / "corrupt__byte_truncated.tif", self.folder / "damaged"
        center = json.loads(run("info", "--json", path).stdout)["center"]
        poses = self.file("damaged.csv", HEADER + f"0,10,0,1200,0,0,0\n1,{center['lat_deg']},{center['lon_deg']},1200,0,0,0\n")
        done = self.render(map=path, poses=poses, out=folder)
        self.assert_fault(done, path, "level 0", "texels 0 to 20 by 0 to 20", "fetch or build it again", "1 frame saw 1 damaged tile")
        before, seen = self.records(folder)
        self.assertEqual(before["damage"], [], "it looks elsewhere")
        self.assertEqual(len(seen["damage"]), 1)
        self.assertEqual(seen["valid_fraction"], 0)
        self.assert_fault(run("info", "--check", path), path, "level 0")

    def test_a_flight_over_a_torn_tile_goes_on_and_says_so(self):
        # The Kampala map with the first half of the packed tile (2, 1) of its level 0 zeroed
        whole = FILES.parent.parent.parent / "sim" / "demo" / "maps" / "kampala.tif"
        dataset = gdal.Open(str(whole))  # a band does not keep its dataset
        offset, size = (int(dataset.GetRasterBand(1).GetMetadataItem(f"BLOCK_{what}_2_1", "TIFF")) for what in ("OFFSET", "SIZE"))
        data = bytearray(whole.read_bytes())
        data[offset:offset + size // 2] = bytes(size // 2)
        torn, folder = self.folder / "torn.tif", self.folder / "torn"
        torn.write_bytes(data)
        runs = FILES.parent.parent.parent / "sim" / "demo" / "runs"
        for name in ("kampala.csv", "rgb.yaml"):
            shutil.copy(runs / name, self.folder / name)
        flight = self.file("torn.yaml", (runs / "kampala.yaml").read_text().replace("../maps/kampala.tif", "torn.tif").replace(
            "duration_s: 23.5", "duration_s: 0.5"))
        done = run("fly", flight, "-o", folder, "--json")
        self.assertEqual(done.returncode, 1, done.stderr)
        fault = done.stderr.splitlines()[-1]
        for words in ("torn.tif: level 0, tile (2, 1): WebP data are damaged", "2 frames saw 1 damaged tile", "fetch or build it again"):
            self.assertIn(words, fault)
        for record in self.records(folder):
            self.assertEqual(len(record["damage"]), 1)
            self.assertGreater(record["valid_fraction"], 0.9, "the rest is there")
        self.assertEqual(run("verify", folder).returncode, 0, "a damaged map gives the same frames again")

    def test_cameras_that_see_no_map(self):
        elsewhere = self.poses(lat=10)
        self.assert_fault(self.render("--off-map", "reject", poses=elsewhere), "no frame was made", "10.000000", self.map, "--off-map mask")
        folder = self.folder / "nothing"
        done = self.render("--no-pictures", poses=elsewhere, out=folder)
        self.assertEqual(done.returncode, 0)
        self.assertIn("no frame shows any of a map; the first camera is at 10.000000", done.stderr)
        self.assertEqual([r["valid_fraction"] for r in self.records(folder)], [0] * 6)

    def test_frames_of_sky_and_from_below_the_ground_are_recorded_as_such(self):
        lat, lon = self.place
        poses = self.file("sky.csv", HEADER + f"0,{lat},{lon},1200,0,180,0\n1,{lat},{lon},-50,0,0,0\n2,{lat},{lon},0,0,0,0\n"
                                              f"3,{lat},{lon},900,0,0,0\n")
        for off_map, seen in (("mask", 4), ("reject", 1)):
            folder = self.folder / f"sky_{off_map}"
            done = self.render("--no-pictures", "--off-map", off_map, poses=poses, out=folder)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertNotIn("nadir ", done.stderr)  # no note; progress there may be
            records = self.records(folder)
            self.assertEqual(len(records), 4)
            self.assertEqual(sum(bool(record["file"]) for record in records), seen)
            for record in records[:3]:
                if off_map == "reject":
                    self.assertIn("sees no ground", record["rejected"])
                    continue
                self.assertEqual(record["valid_fraction"], 0)
                self.assertEqual(record["footprint"]["texel"], [None] * 4)
                self.assertIsNone(record["map_pixel_from_image_pixel"])
                self.assertIsNone(record["image_gsd_m"])
                self.assertEqual(record["damage"], [])
            self.assertEqual(records[3]["valid_fraction"], 1)

    def test_a_map_that_is_written_to_ends_the_run_with_whole_frames(self):
        # Enough poses that the map is written to before the last is rendered; none has its tile in memory for longer than a frame
        changing, folder = self.folder / "changing.tif", self.folder / "changing"
        gdal.Translate(str(changing), str(self.map), width=4096, height=4096, creationOptions=["TILED=YES"])
        center = json.loads(run("info", "--json", changing).stdout)["center"]
        rows = [f"{i},{center['lat_deg'] + 0.004 * (i % 3 - 1)},{center['lon_deg']},60,0,0,0\n" for i in range(20_000)]
        command = [NADIR, "render", "--map", changing, "--camera", self.file("camera.yaml", CAMERA.format(width=64)), "--cache", "256K",
                   "--poses", self.file("many.csv", HEADER + "".join(rows)), "-o", folder, "--no-pictures"]
        process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        path = folder / "footprints.geojson"
        end = time.monotonic() + 60
        while time.monotonic() < end and not (path.exists() and path.stat().st_size > 10_000):
            time.sleep(0.01)
        with open(changing, "r+b") as file:
            file.write(file.read(1))
            file.seek(0)
            file.write(b"I")
        _, said = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, said)
        self.assertIn(f"{changing}: was written to while it was in use: open it again", said.splitlines()[-1])
        self.assertRegex(said.splitlines()[-1], r"frame at \d+ ns")
        records = self.records(folder)
        self.assertGreater(len(records), 5)
        self.assertLess(len(records), 20_000)
        self.assertTrue(all(record["valid_fraction"] == 1 for record in records))

    def test_output_that_cannot_be_written(self):
        there = self.folder / "there"
        there.mkdir()
        (there / "mine.txt").write_text("keep me")
        self.assert_fault(self.render(out=there), there, "is there already", "--force")
        self.assertEqual([p.name for p in there.iterdir()], ["mine.txt"])
        file = self.file("a_file", "")
        self.assert_fault(self.render(out=file / "inside"), file / "inside", "choose another place")
        self.assert_fault(self.render(out="/proc/nadir"), "/proc/nadir")
        with open("/dev/full", "w") as full:
            done = subprocess.run([NADIR, "info", str(self.map)], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        self.assert_fault(done, "standard output", "No space left")

    def test_a_disk_that_gets_full_leaves_whole_frames_only(self):
        whole = self.folder / "whole"
        self.assertEqual(self.render("--no-pictures", out=whole).returncode, 0)
        image_bytes = max(p.stat().st_size for p in whole.glob("frames/**/*.png"))
        records_bytes = (whole / "frames.jsonl").stat().st_size
        listed = {}
        # Not even an image; images, but less than one of six records; four and a half of them; all but part of the last. How long
        # a frame took is in its record, so records differ by a few bytes from run to run.
        for limit in (image_bytes - 1, records_bytes // 7, records_bytes * 3 // 4, records_bytes * 19 // 20):
            folder = self.folder / f"full_{limit}"
            self.assert_fault(self.render("--no-pictures", out=folder, file_bytes=limit), folder, "writing failed", "File too large")
            listed[limit] = len(self.records(folder))
            leftovers = [p for p in folder.rglob("*") if p.name.startswith(".")]
            self.assertEqual(leftovers, [])
            for image in folder.glob("frames/**/*.png"):
                self.assertEqual(image.read_bytes()[-8:-4], b"IEND", image)
        self.assertEqual(max(listed.values()), 5)
        self.assertEqual(min(listed.values()), 0)

    def test_a_run_that_is_killed_leaves_a_whole_file_of_footprints(self):
        folder = self.folder / "killed"
        command = [NADIR, "render", "--map", self.map, "--camera", self.file("camera.yaml", CAMERA.format(width=64)),
                   "--poses", self.poses(frames=20_000), "-o", folder, "--no-pictures"]
        process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        path = folder / "footprints.geojson"
        end = time.monotonic() + 60
        while time.monotonic() < end and not (path.exists() and path.stat().st_size > 10_000):
            time.sleep(0.01)
        process.kill()
        process.wait()
        features = json.loads(path.read_text())["features"]
        self.assertGreater(len(features), 5)
        self.assertLess(len(features), 20_000, "it was killed in its middle")
        # Of the last frame a record may be there, or a part of one, and no footprint yet
        listed = (folder / "frames.jsonl").read_text().splitlines()
        self.assertLessEqual(len(listed) - len(features), 1)

    def test_every_awkward_file_is_described_or_refused_in_one_line(self):
        for path in sorted(FILES.glob("*.tif")):
            with self.subTest(path.name):
                done = run("info", "--check", "--json", path)
                if done.returncode == 0:
                    self.assertEqual(done.stderr, "")
                    self.assertNotIn("nan,", done.stdout.lower())
                else:
                    self.assert_fault(done, path)


if __name__ == "__main__":
    unittest.main()
