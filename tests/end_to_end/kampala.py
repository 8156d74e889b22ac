"""What tests of frames over the Kampala map share: the command, poses, a small camera, records that the schemas hold to."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import jsonschema

NADIR = os.environ["NADIR_BIN"]
SOURCE = pathlib.Path(os.environ["NADIR_SOURCE_DIR"])
MAP = SOURCE / "sim/demo/maps/kampala.tif"
LAT, LON = 0.350874, 32.594719  # in the middle of the map
DEGREES_PER_M = 1 / 110574  # of latitude, here


def nadir(*arguments):
    return subprocess.run([NADIR, *map(str, arguments)], capture_output=True, text=True, timeout=120)


def lines_of(path, schema):
    schema = json.loads((SOURCE / "sim/record" / schema).read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    for line in lines:
        jsonschema.validate(line, schema)
    return lines


def records_of(folder):
    return lines_of(folder / "frames.jsonl", "frames.schema.json")


class OverKampala(unittest.TestCase):
    """A folder of its own with a camera of `width` by 9/16 of it."""
    width = 320

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.out = pathlib.Path(self.folder.name)
        height, focal = self.width * 9 // 16, self.width * 25 / 32
        (self.out / "small.yaml").write_text(f"""image_width: {self.width}
image_height: {height}
camera_name: small
camera_matrix: {{rows: 3, cols: 3, data: [{focal}, 0, {(self.width - 1) / 2}, 0, {focal}, {(height - 1) / 2}, 0, 0, 1]}}
""")

    def tearDown(self):
        self.folder.cleanup()

    def write_poses(self, rows):
        (self.out / "poses.csv").write_text("\n".join(["t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg", *rows, ""]))

    def render(self, name, *more):
        return nadir("render", "--map", MAP, "--name", "eo", "--bands", "1,2,3", "--camera", self.out / "small.yaml", "--poses",
                     self.out / "poses.csv", "-o", self.out / name, "--no-pictures", *more)
