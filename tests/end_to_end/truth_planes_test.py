"""Truth planes from the command to the file: what GDAL reads there is what the pose in the record gives, computed here once more."""
import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import jsonschema
import numpy as np
from osgeo import gdal

gdal.UseExceptions()
NADIR = os.environ["NADIR_BIN"]
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
MAPS = SOURCE / "sim/demo/maps"
LAT, LON = 47.0222, -99.1662  # in the middle of the map
WIDTH, HEIGHT, FOCAL, CX, CY = 320, 180, 250, 159.5, 89.5
CAMERA = f"""image_width: {WIDTH}
image_height: {HEIGHT}
camera_name: small
camera_matrix: {{rows: 3, cols: 3, data: [{FOCAL}, 0, {CX}, 0, {FOCAL}, {CY}, 0, 0, 1]}}
"""
BANDS = ["longitude_deg", "latitude_deg", "height_ellipsoid_m", "range_m", "incidence_deg", "ground_sample_distance_m"]
A, F = 6378137.0, 1 / 298.257223563  # WGS-84
E2 = F * (2 - F)


def nadir(*arguments):
    return subprocess.run([NADIR, *map(str, arguments)], capture_output=True, text=True, timeout=120)


def planes_of(path):
    """The bands of a file by their names."""
    data = gdal.Open(str(path))
    return {data.GetRasterBand(b + 1).GetDescription(): data.GetRasterBand(b + 1).ReadAsArray() for b in range(data.RasterCount)}


def geodetic_from_enu(enu, lat_deg, lon_deg, height_m):
    """Longitude, latitude in degrees and height of points (rows) in the tangent frame at a place."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    n = A / np.sqrt(1 - E2 * np.sin(lat) ** 2)
    origin = np.array([(n + height_m) * np.cos(lat) * np.cos(lon), (n + height_m) * np.cos(lat) * np.sin(lon), (n * (1 - E2) + height_m) * np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0])
    north = np.array([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)])
    x, y, z = (origin + enu @ np.array([east, north, np.cross(east, north)])).T
    p = np.hypot(x, y)
    latitude = np.arctan2(z, p * (1 - E2))
    for _ in range(10):  # each step takes off two digits and more
        n = A / np.sqrt(1 - E2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + E2 * n * np.sin(latitude), p)
    height = p * np.cos(latitude) + z * np.sin(latitude) - A * np.sqrt(1 - E2 * np.sin(latitude) ** 2)
    return np.degrees(np.arctan2(y, x)), np.degrees(latitude), height


def rotation(q):
    w, x, y, z = (q[k] for k in "wxyz")
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def rays():
    """Of all pixels' centres, in camera axes, of depth 1."""
    x, y = np.meshgrid((np.arange(WIDTH) - CX) / FOCAL, (np.arange(HEIGHT) - CY) / FOCAL)
    return np.stack([x, y, np.ones_like(x)], axis=-1)


class TruthPlanes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.out = pathlib.Path(self.folder.name)
        (self.out / "small.yaml").write_text(CAMERA)

    def tearDown(self):
        self.folder.cleanup()

    def render(self, name, *more, pitch_deg=0, maps=("--map", MAPS / "naip_2010.tif", "--name", "eo", "--bands", "1,2,3")):
        poses = self.out / f"{name}.csv"
        poses.write_text(f"t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n1.5,{LAT},{LON},900,30,{pitch_deg},0\n")
        done = nadir("render", *maps, "--camera", self.out / "small.yaml", "--poses", poses, "--origin", f"{LAT},{LON},0",
                     "-o", self.out / name, "--no-pictures", *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.records(self.out / name)

    def records(self, folder):
        return [json.loads(line) for line in (folder / "frames.jsonl").read_text().splitlines()]

    def files(self, folder):
        return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.glob("frames/**/*.*"))}

    def test_a_view_straight_down_is_that_of_triangles(self):
        record, = self.render("a", "--truth-planes")
        self.assertEqual(record["truth_planes"], "frames/vehicle/eo/000001500000000.truth.tif")
        planes = planes_of(self.out / "a" / record["truth_planes"])
        self.assertEqual(list(planes), BANDS)
        aside = np.hypot(*rays()[..., :2].transpose(2, 0, 1))
        # Half a step of float32: 6.1e-5 from 1024 m on, 1.9e-6 from 32 degrees on, 1.2e-7 from 2 m on
        np.testing.assert_allclose(planes["range_m"], 900 / np.cos(np.arctan(aside)), rtol=0, atol=6.2e-5)
        np.testing.assert_allclose(planes["incidence_deg"], np.degrees(np.arctan(aside)), rtol=0, atol=2e-6)
        np.testing.assert_allclose(planes["ground_sample_distance_m"], 900 / FOCAL, rtol=0, atol=1.3e-7)

        # On the ground: the top of the image looks to 30 degrees from north
        yaw = np.radians(30)
        right, forward = 900 * rays()[..., 0].ravel(), -900 * rays()[..., 1].ravel()
        enu = np.stack([right * np.cos(yaw) + forward * np.sin(yaw), -right * np.sin(yaw) + forward * np.cos(yaw), np.zeros_like(right)], axis=-1)
        longitude, latitude, height = geodetic_from_enu(enu, LAT, LON, 0)
        # 1e-11 degrees are a micrometre
        np.testing.assert_allclose(planes["longitude_deg"].ravel(), longitude, rtol=0, atol=1e-11)
        np.testing.assert_allclose(planes["latitude_deg"].ravel(), latitude, rtol=0, atol=1e-11)
        np.testing.assert_allclose(planes["height_ellipsoid_m"].ravel(), height, rtol=0, atol=1e-6)

    def test_a_view_over_the_horizon_follows_from_the_pose_in_the_record(self):
        record, = self.render("a", "--truth-planes", pitch_deg=80)
        planes = planes_of(self.out / "a" / record["truth_planes"])
        directions = rays() @ rotation(record["pose"]["enu_from_camera_quat"]).T
        camera = np.array(record["pose"]["enu_m"])
        with np.errstate(divide="ignore"):
            depth = -camera[2] / directions[..., 2]
        seen = (depth > 0) & (depth < 1e6)  # beyond 1000 km a plane does not count as ground
        self.assertTrue(0.2 < seen.mean() < 0.8, "ground and sky")
        for name, plane in planes.items():
            if name != "ground_sample_distance_m":  # which looks at corners
                np.testing.assert_array_equal(np.isfinite(plane), seen, name)
        away = directions[seen] * depth[seen][:, None]
        distance = np.linalg.norm(away, axis=-1)
        longitude, latitude, height = geodetic_from_enu(camera + away, LAT, LON, 0)
        np.testing.assert_allclose(planes["range_m"][seen], distance, rtol=1e-7)
        np.testing.assert_allclose(planes["incidence_deg"][seen], np.degrees(np.arccos(camera[2] / distance)), rtol=0, atol=1e-5)
        np.testing.assert_allclose(planes["longitude_deg"][seen], longitude, rtol=0, atol=1e-10)
        np.testing.assert_allclose(planes["latitude_deg"][seen], latitude, rtol=0, atol=1e-10)
        np.testing.assert_allclose(planes["height_ellipsoid_m"][seen], height, rtol=1e-7, atol=1e-6)

    def test_threads_change_no_byte_and_nothing_is_made_unasked(self):
        schema = json.loads((SOURCE / "sim/record/frames.schema.json").read_text())
        for name, more in {"a": ["--truth-planes", "--threads", 1], "b": ["--truth-planes", "--threads", 3], "none": []}.items():
            for record in self.render(name, *more):
                jsonschema.validate(record, schema)
        self.assertEqual(self.files(self.out / "a"), self.files(self.out / "b"))
        self.assertIsNone(self.records(self.out / "none")[0]["truth_planes"])
        left = dict(self.files(self.out / "a"))
        left.pop("frames/vehicle/eo/000001500000000.truth.tif")
        self.assertEqual(left, self.files(self.out / "none"))

    def test_layers_of_one_pose_share_a_file(self):
        layer = lambda name: ("--map", MAPS / "naip_2010.tif", "--name", name, "--bands", "1")
        records = self.render("a", "--truth-planes", maps=(*layer("one"), *layer("two")))
        self.assertEqual([r["truth_planes"] for r in records], ["frames/vehicle/one/000001500000000.truth.tif"] * 2)
        self.assertEqual([name for name in self.files(self.out / "a") if name.endswith(".truth.tif")], ["frames/vehicle/one/000001500000000.truth.tif"])

    def test_planes_without_a_folder_are_refused(self):
        done = nadir("render", "--map", MAPS / "naip_2010.tif", "--camera", self.out / "small.yaml", "--poses", "p.csv", "--no-output", "--truth-planes")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--no-output excludes --truth-planes", done.stderr)

    def test_a_flight_has_them_and_verify_looks_at_them(self):
        (self.out / "poses.csv").write_text("t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n" +
                                            "".join(f"{t},{LAT + 1e-4 * t},{LON},900,30,{10 * t},0\n" for t in range(3)))
        (self.out / "run.yaml").write_text(f"""duration_s: 2
scene:
  layers: {{eo: {{map: {MAPS}/naip_2010.tif, bands: [1, 2, 3]}}}}
vehicles:
  copter: {{model: poses, poses: poses.csv, sensors: {{rgb: {{layer: eo, camera: small.yaml, rate_hz: 1}}}}}}
record: {{truth_planes: true, report: false}}
""")
        flight = self.out / "flight"
        done = nadir("fly", self.out / "run.yaml", "-o", flight, "--threads", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        files = [flight / record["truth_planes"] for record in self.records(flight)]
        self.assertEqual(len(files), 3)
        said = nadir("verify", flight, "--json")
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertEqual(json.loads(said.stdout)["truth_planes_compared"], 3)

        # Those of another frame, a damaged file, none
        kept = files[0].read_bytes()
        shutil.copy(files[1], files[0])
        self.assertIn("copter/rgb at 0 ns: its truth planes are not what the run gives", nadir("verify", flight).stdout)
        files[0].write_bytes(kept[:len(kept) // 2])
        self.assertIn(str(files[0]), nadir("verify", flight).stdout)
        files[0].unlink()
        done = nadir("verify", flight, "--frames", 0)
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"{files[0].relative_to(flight)} is missing", done.stdout)


if __name__ == "__main__":
    unittest.main()
