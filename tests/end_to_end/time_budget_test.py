"""Time budgets, from the command and the run file: resolved before the first frame, recorded, and frames that hang on nothing else."""
import hashlib
import json
import re
import unittest

from kampala import DEGREES_PER_M, LAT, LON, MAP, OverKampala, lines_of, nadir, records_of

AMPLE, TOO_LITTLE = 60_000, 0.001  # ms: the finest sampling of these small frames takes a few, the cheapest a tenth


def hashes(folder, *patterns):
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for pattern in patterns for p in sorted(folder.glob(pattern)) if p.is_file()}


def budgets_of(folder):
    return lines_of(folder / "time_budgets.jsonl", "time_budgets.schema.json")


def truth_of(folder):
    """The records without what a clock measured."""
    return [{k: v for k, v in record.items() if k != "render_ms"} for record in records_of(folder)]


class TimeBudget(OverKampala):
    width = 160

    def setUp(self):
        super().setUp()
        self.rows = [f"{t},{LAT + t * 5 * DEGREES_PER_M:.9f},{LON},{60 + 10 * t} agl,{15 * t},0,0" for t in range(7)]
        self.write_poses(self.rows)

    def write_run(self, sampling):
        (self.out / "run.yaml").write_text(f"""duration_s: 2
scene:
  layers: {{eo: {{map: {MAP}, bands: [1, 2, 3]}}}}
vehicles:
  copter: {{model: poses, poses: poses.csv, sensors: {{rgb: {{layer: eo, camera: small.yaml, rate_hz: 4, {sampling}}}}}}}
  plane: {{start: {{height: 70 agl}}, sensors: {{rgb: {{layer: eo, camera: small.yaml, rate_hz: 2}}}}}}
record: {{report: false}}
""")

    def fly(self, name, *more):
        done = nadir("fly", self.out / "run.yaml", "-o", self.out / name, *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def assert_verified(self, folder):
        said = nadir("verify", folder, "--json", "--frames", 1000)
        self.assertEqual(said.returncode, 0, said.stderr + said.stdout)
        self.assertEqual(json.loads(said.stdout)["frames_rendered"], len(records_of(folder)))

    def test_frames_are_those_of_the_settings_that_it_was_resolved_to(self):
        done = self.render("ample", "--time-budget", AMPLE, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("nadir ", done.stderr)  # no note; progress there may be
        said = json.loads(done.stdout)
        self.assertEqual(self.render("plain", "--quality", "balanced", "--oversampling", 8.1).returncode, 0)
        self.assertEqual(truth_of(self.out / "ample"), truth_of(self.out / "plain"))
        self.assertEqual(hashes(self.out / "ample", "frames/**/*"), hashes(self.out / "plain", "frames/**/*"))
        budget, = budgets_of(self.out / "ample")
        self.assertEqual(said["time_budget"], budget)
        self.assertEqual(said["late"], 0)
        self.assertEqual((budget["time_budget_ms"], budget["adaptive"], budget["fits"], budget["frames_tried"], budget["sensors"]), (AMPLE, False, True, 5, ["eo"]))
        self.assertEqual(budget["settings"], {"quality": "balanced", "oversampling": 8.1})
        ladder = [way["oversampling"] for way in budget["measured"]]
        self.assertEqual(ladder, [None, 1.1, 1.6, 2.1, 3.1, 4.1, 6.1, 8.1])
        self.assertEqual(budget["expected_ms"], budget["measured"][-1]["slowest_ms"])
        self.assertEqual(sorted(p.name for p in (self.out / "ample").iterdir()), ["camera", "footprints.geojson", "frames", "frames.jsonl", "time_budgets.jsonl"],
                         "nothing is left of the frames that were tried")
        self.assertFalse((self.out / "plain/time_budgets.jsonl").exists())
        # Another dataset over it leaves nothing of it
        self.assertEqual(self.render("ample", "--force").returncode, 0)
        self.assertFalse((self.out / "ample/time_budgets.jsonl").exists())

    def test_where_nothing_is_fast_enough_the_cheapest_is_taken_and_said(self):
        done = self.render("hasty", "--time-budget", TOO_LITTLE)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"nadir render: note: time budget 0.001 ms: not kept: draft, .* takes [\d.]+ ms")
        self.assertIn("7 over the time budget", done.stdout)
        self.assertEqual(self.render("draft", "--quality", "draft").returncode, 0)
        self.assertEqual(truth_of(self.out / "hasty"), truth_of(self.out / "draft"))
        budget, = budgets_of(self.out / "hasty")
        self.assertFalse(budget["fits"])
        self.assertEqual(len(budget["measured"]), 1)

    def test_one_pose_and_poses_that_see_nothing(self):
        self.write_poses(self.rows[:1])
        done = self.render("one", "--time-budget", AMPLE)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("nadir ", done.stderr)  # no note; progress there may be
        self.assertIn("time budget 60000 ms: balanced, oversampling 8.1, which takes", done.stdout)
        self.assertIn("in the frame tried", done.stdout)
        self.write_poses([row.replace(str(LON), str(LON + 1)) for row in self.rows])
        done = self.render("nothing", "--time-budget", AMPLE)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("no frame tried sees a map", done.stderr)
        budget, = budgets_of(self.out / "nothing")
        self.assertEqual((budget["expected_ms"], budget["measured"], budget["frames_tried"]), (None, [], 0))
        self.assertEqual(records_of(self.out / "nothing")[0]["settings"]["quality"], "draft")

    def test_adaptive_frames_say_so(self):
        done = self.render("adaptive", "--time-budget", TOO_LITTLE, "--adaptive")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("adaptive", done.stderr)
        self.assertEqual({(r["settings"]["adaptive"], r["settings"]["quality"]) for r in records_of(self.out / "adaptive")}, {(True, "draft")})
        self.assertTrue(budgets_of(self.out / "adaptive")[0]["adaptive"])

    def test_a_flight_replays_to_the_same_bytes(self):
        for budget, resolved in ((AMPLE, "quality: balanced, oversampling: 8.1, fitted_to_ms: 60000"), (TOO_LITTLE, "quality: draft, fitted_to_ms: 0.001")):
            self.write_run(f"time_budget_ms: {budget}")
            first, again = self.out / f"first{budget}", self.out / f"again{budget}"
            done = self.fly(first.name)
            self.assertIn(f"time budget {budget} ms", done.stdout + done.stderr)
            self.assertIn(resolved, (first / "run.yaml").read_text())
            self.assertNotIn("time_budget_ms", (first / "run.yaml").read_text())
            budgets = budgets_of(first)
            self.assertEqual([(b["vehicle"], b["sensors"], b["time_budget_ms"]) for b in budgets], [("copter", ["rgb"], budget)], "the other sensor has none")
            done = nadir("fly", first / "run.yaml", "-o", again)
            self.assertEqual(done.returncode, 0, done.stderr)
            patterns = ("frames/**/*", "telemetry/**/*", "camera/**/*", "footprints.geojson", "run.yaml")
            self.assertEqual(hashes(first, *patterns), hashes(again, *patterns))
            self.assertEqual(truth_of(first), truth_of(again))
            quality = {r["vehicle"]: (r["settings"]["quality"], r["settings"]["oversampling"]) for r in records_of(first)}
            self.assertEqual(quality, {"copter": ("balanced", 8.1) if budget == AMPLE else ("draft", 1), "plane": ("balanced", 1.6)})
            for folder in (first, again):
                self.assert_verified(folder)

    def test_an_adaptive_flight_is_verified_by_its_records(self):
        self.write_run(f"time_budget_ms: {TOO_LITTLE}, adaptive: true")
        flight = self.out / "flight"
        said = json.loads(self.fly("flight", "--json").stdout)
        self.assertEqual(said["late"], 9)
        self.assertEqual(said["time_budgets"], budgets_of(flight))
        self.assertIn("time_budget_ms: 0.001, adaptive: true", (flight / "run.yaml").read_text(), "a replay adapts again")
        self.assertEqual({(r["vehicle"], r["settings"]["adaptive"], r["settings"]["quality"]) for r in records_of(flight)}, {("copter", True, "draft"), ("plane", False, "balanced")})
        self.assert_verified(flight)

        text = (flight / "frames.jsonl").read_text()
        for old, new, words in ((r'"quality":"draft"(.*?"oversampling":)1.0', r'"quality":"balanced"\g<1>4.1', "its checksum differs"),
                                ('"adaptive":true', '"adaptive":false', "does not say that it is adaptive"), ('"adaptive":false', '"adaptive":true', "does not say that it is not adaptive"),
                                ('"quality":"draft"', '"quality":7', "lack a quality"), ('"quality":"draft"', '"quality":"drafty"', "drafty")):
            altered, count = re.subn(old, new, text)
            self.assertGreater(count, 0, old)
            (flight / "frames.jsonl").write_text(altered)
            done = nadir("verify", flight, "--frames", 1000)
            self.assertEqual(done.returncode, 1, new)
            self.assertIn(words, done.stdout)

    def test_an_adaptive_flight_with_time_to_spare_takes_the_finest(self):
        self.write_run(f"time_budget_ms: {AMPLE}, adaptive: true")
        self.fly("flight")
        self.assertEqual({r["settings"]["oversampling"] for r in records_of(self.out / "flight") if r["vehicle"] == "copter"}, {8.1})
        self.assert_verified(self.out / "flight")

    def test_a_rehearsal_resolves_nothing_and_doctor_says_what_would_be_chosen(self):
        self.write_run(f"time_budget_ms: {AMPLE}")
        done = self.fly("rehearsal", "--dry-run")
        self.assertNotIn("time budget", done.stdout)
        self.assertIn(f"time_budget_ms: {AMPLE}", (self.out / "rehearsal/run.yaml").read_text())
        done = nadir("doctor", self.out / "run.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("copter/rgb: time budget 60000 ms: balanced, oversampling 8.1", done.stdout)

    def test_faults_are_said(self):
        for value in ("-1", "0", "nan", "inf", "soon"):
            done = self.render("never", "--time-budget", value)
            self.assertIn(done.returncode, (1, 2))
            self.assertRegex(done.stderr, r"time.budget")
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        for other in (["--quality", "best"], ["--filter", "mip"], ["--max-error", "2"], ["--oversampling", "2"]):
            done = self.render("never", "--time-budget", 10, *other)
            self.assertEqual(done.returncode, 2)
            self.assertIn("--time-budget", done.stderr)
            self.assertIn(other[0], done.stderr)
        done = self.render("never", "--adaptive")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--adaptive requires --time-budget", done.stderr)
        for sampling, words in (("time_budget_ms: -1", "expected a positive number, found -1"), ("time_budget_ms: .nan", "time_budget_ms"), ("time_budget_ms: soon", "time_budget_ms"),
                                ("adaptive: true", "expected time_budget_ms beside it"), ("time_budget_ms: 5, quality: best", "leave out one of them"),
                                ("time_budget_ms: 5, oversampling: 2", "leave out one of them"), ("oversampling: 99", "expected 0.5 to 16")):
            self.write_run(sampling)
            done = nadir("fly", self.out / "run.yaml", "-o", self.out / "never")
            self.assertEqual(done.returncode, 1)
            self.assertIn("run.yaml:5:", done.stderr)
            self.assertIn(words, done.stderr)
        self.assertFalse((self.out / "never").exists())


if __name__ == "__main__":
    unittest.main()
