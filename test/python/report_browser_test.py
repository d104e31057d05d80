#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The report in headless Chromium: opened, played, zoomed, and its pictures compared with what is computed here.

Wants chromium, chromium-driver and python3-selenium; skipped, and said so, without them."""
import io
import json
import pathlib
import shutil
import tempfile
import time
import unittest

import numpy as np

import contact_flow as cf
import case
from contact_flow import report_three
from report_test import WEBGL, data_of

try:
    import matplotlib.image
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.chrome.service import Service
except ImportError as reason:
    MISSING = str(reason)
else:
    MISSING = "" if shutil.which("chromium") and shutil.which("chromedriver") else "no chromium with its driver"

BLUE, ORANGE = np.array([0x1f, 0x77, 0xb4]), np.array([0xd9, 0x5f, 0x02])
LEFT, RIGHT = 116, 8   # margins of the plots in time [pixels]


def like(picture, colour, within=12):
    """Where a picture has this colour."""
    return np.all(np.abs(picture.astype(int) - colour) <= within, axis=2)


@unittest.skipIf(MISSING, MISSING)
class Browser(unittest.TestCase):
    """With WebGL: three.js draws."""
    FLAGS = WEBGL
    PAINTER = "three.js" if report_three.library()[0] else "canvas"

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for word in ("--headless", "--no-sandbox", *cls.FLAGS, "--window-size=1100,900",
                     "--force-device-scale-factor=1", "--user-data-dir=" + cls.folder.name + "/profile"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        cls.driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
        cls.robot = cf.Robot(case.ROBOTS / "hopping_trot.yaml")
        cls.run_ = cls.robot.simulate()
        cls.path = pathlib.Path(cls.folder.name) / "trot.html"
        cls.run_.report(cls.path)
        cls.data = data_of(cls.path.read_text(encoding="utf-8"))

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        cls.folder.cleanup()

    def open(self, path=None, instant=None):
        self.driver.get("about:blank")
        self.driver.get((path or self.path).as_uri() + ("" if instant is None else "#t=%g" % instant))
        self.assertEqual("yes", self.driver.execute_script("return document.body.dataset.ready"))
        for canvas in self.driver.find_elements(By.ID, "robot"):
            self.assertEqual(self.PAINTER, canvas.get_attribute("data-painter"))

    def tearDown(self):
        self.assertEqual([], [entry for entry in self.driver.get_log("browser")
                              if entry["level"] in ("SEVERE", "WARNING")])

    def canvas(self, name):
        found = self.driver.find_element(By.ID, name)
        self.driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", found)
        return found

    def picture(self, name):
        return (255 * matplotlib.image.imread(io.BytesIO(self.canvas(name).screenshot_as_png))[..., :3]).round()

    def wait(self, script, seconds=20):
        end = time.time() + seconds
        while time.time() < end:
            value = self.driver.execute_script("return " + script)
            if value:
                return value
            time.sleep(0.02)
        self.fail(script + " stays false")

    def test_opened(self):
        self.open()
        self.assertIn("hopping_trot", self.driver.find_element(By.ID, "title").text)
        after = self.driver.execute_script(
            "const t = performance.timing; return t.domContentLoadedEventEnd - t.navigationStart")
        print("interactive after %d ms" % after)
        loaded = self.driver.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
        self.assertEqual([], [name for name in loaded if not name.startswith("data:")])

    def test_ensemble(self):
        """Cells of the basin have the colours of its words, in their shares; prediction and words are drawn."""
        draws = {"body_pitch": cf.Uniform(-0.3, 0.3), "d/dt body_pitch": cf.Uniform(-0.5, 0.5)}
        path = pathlib.Path(self.folder.name) / "ensemble.html"
        swept = cf.Model("soft_biped").sweep(draws, 2000, seed=1, duration=0.9)
        swept.report(path)
        self.open(path)
        shown = data_of(path.read_text(encoding="utf-8"))["ensemble"]["basin"]
        cells = np.array(shown["cells"])
        basin = self.picture("basin")
        blue, orange = (int(like(basin, colour).sum()) for colour in (BLUE, ORANGE))
        self.assertGreater(blue, orange)
        self.assertAlmostEqual(np.sum(cells == 0) / np.sum(cells == 1), blue / orange, delta=0.1 * blue / orange)
        self.assertGreater(like(self.picture("spread"), ORANGE, 60).sum(), 100)
        self.assertGreater(np.sum(np.any(self.picture("tree") < 250, axis=2)), 1000)
        self.assertIn("2000 runs", self.driver.find_element(By.ID, "ensemble-words").text)
        self.open()   # a run alone has none
        self.assertEqual([], self.driver.find_elements(By.ID, "ensemble"))

    def test_strip(self):
        """Bars from touchdown to lift-off, where the run has them."""
        self.open()
        strip = self.picture("strip")
        width = strip.shape[1]
        for colour, name in ((BLUE, "left_foot"), (ORANGE, "right_foot")):
            columns = np.flatnonzero(like(strip, colour).sum(axis=0) >= 8)
            arc = [a for a in self.run_.arcs if name in a.mode]
            span = self.run_.t_end - self.run_.t_begin
            for column, t in ((columns[0], arc[0].t_begin), (columns[-1], arc[-1].t_end)):
                self.assertLess(abs(column - (LEFT + t / span * (width - LEFT - RIGHT))), 3)

    def test_played(self):
        self.open()
        button = self.driver.find_element(By.ID, "play")
        self.assertEqual("play", button.text)
        button.click()
        last = len(self.data["figure"]["t"]) - 1
        self.wait("Number(document.getElementById('robot').dataset.frame) > 0")
        self.wait("Number(document.getElementById('robot').dataset.frame) === %d" % last)
        self.wait("document.getElementById('play').textContent === 'play'")
        self.assertIn("t = 0.8", self.driver.find_element(By.ID, "cursor").text)

    def test_zoomed_with_a_common_cursor(self):
        self.open()
        strip = self.canvas("strip")
        width = strip.size["width"]
        at = lambda t: int(round(LEFT + t / 0.8 * (width - LEFT - RIGHT) - width / 2))   # noqa: E731
        ActionChains(self.driver).move_to_element_with_offset(strip, at(0.4), 0).perform()
        frames = self.data["figure"]["t"]
        self.assertLess(abs(frames[int(self.canvas("robot").get_attribute("data-frame"))] - 0.4), 0.005)
        self.assertIn("left_foot, right_foot", self.driver.find_element(By.ID, "cursor").text)
        ActionChains(self.driver).move_to_element_with_offset(self.canvas("strip"), at(0.05), 0).click_and_hold() \
            .move_by_offset(at(0.25) - at(0.05), 0).release().perform()
        begin, end = self.driver.execute_script("return [view.from, view.to]")
        self.assertLess(abs(begin - 0.05) + abs(end - 0.25), 0.01)
        # All pictures follow: the touchdown at 0.1 s is a quarter of the way.
        for name in ("strip", "plot-q", "plot-f"):
            image = self.picture(name)
            red = np.flatnonzero(like(image, np.array([0xe2, 0xb4, 0xb4]), 25).sum(axis=0) >= 0.3 * image.shape[0])
            wanted = LEFT + (0.1 - begin) / (end - begin) * (image.shape[1] - LEFT - RIGHT)
            self.assertLess(np.abs(red - wanted).min(), 3, name)
        ActionChains(self.driver).double_click(self.canvas("plot-v")).perform()
        self.assertEqual([0, 0.8], np.round(self.driver.execute_script("return [view.from, view.to]"), 9).tolist())

    def body(self, instant):
        """Row of the middle of the body [pixels]: of the dark faces of its box."""
        self.open(instant=instant)
        select = self.driver.find_element(By.CSS_SELECTOR, "#ghosts select")
        self.driver.execute_script("arguments[0].value = 0; arguments[0].dispatchEvent(new Event('change'))", select)
        image = self.picture("robot")
        dark = np.argwhere(image.max(axis=2) < 112)
        self.assertGreater(len(dark), 500)
        return dark[:, 0].mean()

    def test_the_body_is_where_the_run_has_it(self):
        """A shift along z by Δz moves it by 0.8 · 380 / span · cos(0.25) · Δz pixels on the screen, the span being that
        of the motion and of the bodies' surfaces where it begins."""
        figure = self.data["figure"]
        places = np.array([[p[:3] for p in frame] for frame in figure["poses"]], dtype=float).reshape(-1, 3)
        contacts = np.array([p[:3] for frame in figure["contacts"] for p in frame], dtype=float)
        least = np.ptp(np.concatenate([places, contacts]), axis=0).max()
        self.open()
        span = float(self.canvas("robot").get_attribute("data-span"))
        self.assertGreater(span, least)
        self.assertLess(span, least + 2 * max(max(shape["size"]) for shape in figure["shapes"] if shape["size"]))
        z = [self.run_.x(t)[self.robot.state_names.index("base_z")] for t in (0.0, 0.4)]
        wanted = 0.8 * 380 / span * np.cos(0.25) * (z[0] - z[1])
        self.assertGreater(wanted, 50)
        self.assertLess(abs(self.body(0.4) - self.body(0.0) - wanted), 6)

    def dark(self):
        """Rows and columns of the pixels of the body, below the time."""
        picture = self.picture("robot")
        picture[:24] = 255
        return np.argwhere(picture.max(axis=2) < 112)

    def drag(self, dx, dy, *keys):
        actions = ActionChains(self.driver)
        for key in keys:
            actions.key_down(key)
        actions.move_to_element(self.canvas("robot")).click_and_hold().move_by_offset(dx, dy).release()
        for key in keys:
            actions.key_up(key)
        actions.perform()

    def test_moved_zoomed_and_turned(self):
        """Moved: by as many pixels as the pointer. Zoomed: areas by the square. Turned by 180°, 0.01 a pixel, at an elevation of
        0: mirrored. A double click undoes all of it."""
        self.body(0.4)
        first = self.dark()
        self.drag(90, -40, Keys.SHIFT)
        self.assertLess(np.abs(self.dark().mean(axis=0) - first.mean(axis=0) - [-40, 90]).max(), 3)
        ActionChains(self.driver).double_click(self.canvas("robot")).perform()
        self.assertLess(np.abs(self.dark().mean(axis=0) - first.mean(axis=0)).max(), 0.5)
        self.driver.execute_script("document.getElementById('robot').dispatchEvent(new WheelEvent('wheel', {deltaY: 400}))")
        self.assertAlmostEqual(np.exp(-0.8), len(self.dark()) / len(first), delta=0.06)
        ActionChains(self.driver).double_click(self.canvas("robot")).perform()
        self.drag(0, -25)   # from 0.25
        level = self.dark()[:, 1] - self.canvas("robot").size["width"] / 2
        self.drag(314, 0)
        turned = self.dark()[:, 1] - self.canvas("robot").size["width"] / 2
        for a, b in ((level.max(), -turned.min()), (level.min(), -turned.max())):
            self.assertLess(abs(a - b), 4)

    def test_ghosts(self):
        self.open(instant=0.4)
        count = lambda: [int(like(self.picture("robot"), 255 + 0.28 * (c - 255), 16).sum())   # noqa: E731
                         for c in (ORANGE, BLUE)]
        drawn = np.array(count())
        self.assertGreater(drawn.min(), 150)
        select = self.driver.find_element(By.CSS_SELECTOR, "#ghosts select")
        self.driver.execute_script("arguments[0].value = 0; arguments[0].dispatchEvent(new Event('change'))", select)
        gone = np.array(count())   # what is left are edges of arrows
        self.assertTrue(np.all(gone < 0.25 * drawn), (drawn, gone))

    def test_sectors_are_the_cones(self):
        """Of two axes, each piece has the angle that piece_at says."""
        self.open()
        B = self.run_.derivative()
        pieces = B.pieces()
        axes = [B.tangents[int(s.get_attribute("value"))]
                for s in self.driver.find_elements(By.CSS_SELECTOR, "#axes select")]
        angles = 2 * np.pi * (np.arange(360) + 0.5) / 360
        found = [pieces.piece_at(np.cos(f) * B.direction("+" + axes[0]) + np.sin(f) * B.direction("+" + axes[1]))
                 for f in angles]
        image = self.picture("pieces")
        shares = np.array([like(image, colour).sum() for colour in (BLUE, ORANGE)], dtype=float)
        wanted = np.bincount(found, minlength=2)[:2] / 360
        self.assertGreater(wanted.min(), 0.05)
        self.assertLess(np.abs(shares / shares.sum() - wanted).max(), 0.02)
        words = self.driver.find_element(By.ID, "words").text
        for piece in pieces:
            self.assertIn(", then ".join(piece.omega[0]), words)

    def test_other_runs(self):
        """A discontinuous outcome, a model in a plane, one without places, a robot with friction."""
        for run, shown in ((cf.Model("rigid_biped").simulate(), "There is none: discontinuous"),
                           (cf.Model("corner").simulate(), "floor"),
                           (cf.Model("double_pendulum").simulate(), "elbow"),
                           (cf.Robot(case.ROBOTS / "planar_biped_friction.yaml").simulate(duration=0.5), "left_foot")):
            with self.subTest(run.system.name):
                path = pathlib.Path(self.folder.name) / (run.system.name + ".html")
                run.report(path)
                self.open(path)
                self.assertIn(shown, self.driver.find_element(By.TAG_NAME, "body").text)
                self.assertEqual([], [e for e in self.driver.get_log("browser") if e["level"] == "SEVERE"])
                json.dumps(data_of(path.read_text(encoding="utf-8")))


class WithoutWebGL(Browser):
    """All of it once more: the canvas draws."""
    FLAGS = ("--disable-gpu", "--disable-software-rasterizer")
    PAINTER = "canvas"


if __name__ == "__main__":
    case.main()
