# SPDX-License-Identifier: BSD-3-Clause
"""An operator's session in a real browser: console_browser.py BERTH WORK LCM_URL [PICTURES].

Brings a cell up, runs an approach from the page, holds, resumes, takes control over from a second viewer, aborts, runs
another procedure through an alarm and its reset, and opens the replay of that approach. With a directory, writes there
the pictures that the documentation shows."""
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

from selenium import webdriver
from selenium.common.exceptions import TimeoutException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

berth, work, url = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
pictures = pathlib.Path(sys.argv[4]) if len(sys.argv) > 4 else None
runs = work / "runs"

# Messages of a browser about its missing graphics card are no fault of the page.
graphics = re.compile(r"GL Driver Message|GPU stall|swiftshader|WebGL", re.IGNORECASE)


# Without a graphics card the processor paints every pixel: large only for pictures.
small, large = (1100, 800), (1680, 1190)


class Viewer:
    def __init__(self, address):
        options = webdriver.ChromeOptions()
        for flag in ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                     "--hide-scrollbars"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.browser.set_script_timeout(60)
        self.browser.set_window_size(*small)
        self.look(address)

    def look(self, address):
        self.browser.get(address)
        self.until("connected", lambda: self.body("connection") == "open", 60)

    def script(self, text, *arguments):
        return self.browser.execute_script(text, *arguments)

    def section(self, name):
        return self.script("return window.berthConsole.board[arguments[0]] || {}", name)

    def length(self, name):
        return self.script("return (window.berthConsole.board[arguments[0]] || []).length", name)

    def body(self, name):
        return self.script("return document.body.dataset[arguments[0]]", name)

    def data(self, selector, name):
        return self.script("const e = document.querySelector(arguments[0]); return e && e.dataset[arguments[1]]", selector, name)

    def text(self, selector):
        return self.script("return document.querySelector(arguments[0]).textContent", selector)

    def click(self, selector):
        self.until(f"{selector} can be clicked", lambda: self.script(
            "const e = document.querySelector(arguments[0]);"
            "return e && e.offsetParent !== null && e.getAttribute('aria-disabled') !== 'true'", selector), 15)
        self.browser.find_element(By.CSS_SELECTOR, selector).click()

    def has_control(self):
        """Takes control again where a busy machine kept the page from renewing it."""
        if self.body("control") == "nobody":
            self.script("document.querySelector('#take-control').click()")  # it may just be hidden
        return self.body("control") == "mine"

    def steer(self):
        """Takes control, or gets as far as the dialog that confirms it."""
        if self.body("control") == "mine":
            return
        self.click("#take-control")
        self.until("control", lambda: self.script("return document.querySelector('#confirm-dialog').open") or
                   self.has_control(), 20)

    def use(self, selector, effect, seconds=10):
        """Control, then a click, until it has its effect."""
        end = time.monotonic() + 6 * seconds
        while True:
            self.steer()
            self.click(selector)
            again = time.monotonic() + seconds
            while time.monotonic() < again:
                if effect():
                    return
                time.sleep(0.1)
            assert time.monotonic() < end, f"{selector} has no effect: {self.text('#notice')}"

    def abort(self, reason):
        """Until it is obeyed: on a busy machine control may lapse between the dialog and its answer."""
        def obeyed():
            if self.is_open("#reason-dialog"):
                self.script("document.querySelector('#reason-text').value = arguments[0]", reason)
                self.click("#reason-send")
            return self.data("#running", "procedureState") != "running"
        self.use("#abort", obeyed)

    def is_open(self, dialog):
        return self.script("return document.querySelector(arguments[0]).open", dialog)

    def say_yes(self):
        self.until("asked for confirmation", lambda: self.script("return document.querySelector('#confirm-dialog').open"), 15)
        text = self.text("#confirm-text")
        self.click("#confirm-yes")
        return text

    def until(self, what, condition, seconds):
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                self.browser.save_screenshot(str(work / "failed.png"))
                raise AssertionError(f"not within {seconds} s: {what}; {self.text('#state')} {self.text('#notice')}"
                                     f" {self.browser.get_log('browser')}; {work}/failed.png")
            time.sleep(0.1)

    def until_procedure(self, state, seconds):
        self.until(f"procedure {state}", lambda: self.data("#running", "procedureState") == state, seconds)

    def colours(self, scheme):
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia",
                                     {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
        time.sleep(1)

    def picture(self, name):
        self.browser.set_window_size(*large)
        time.sleep(3)
        for patience in (3, 2, 1, 0):
            try:
                self.browser.save_screenshot(str(work / name))
                break
            except TimeoutException:  # everything is drawn by the processor
                if patience == 0:
                    raise
        self.browser.set_window_size(*small)
        assert (work / name).stat().st_size > 80000, f"{name}: next to nothing is drawn"
        if pictures:
            (pictures / name).write_bytes((work / name).read_bytes())

    def check_silence(self):
        messages = [line for line in self.browser.get_log("browser") if not graphics.search(line["message"])]
        assert not messages, f"the browser's console is not silent: {messages}"

    def close(self):
        self.check_silence()
        self.browser.quit()


def distance(a, b):
    return math.dist(a[:3], b[:3])


def joints(viewer):
    arms = viewer.section("arms")
    return arms["replica"]["reported_joint"] + arms["sensor"]["reported_joint"]


def console_address(run):
    file = run / "output" / "console.url"
    for _ in range(300):
        if file.exists() and file.read_text().strip():
            return file.read_text().strip()
        time.sleep(0.1)
    raise AssertionError("the console does not serve")


def begin(operator, procedure, **parameters):
    operator.use("#run", lambda: operator.is_open("#run-dialog"))
    operator.script("const s = document.querySelector('#run-procedure'); s.value = arguments[0];"
                    "s.dispatchEvent(new Event('change', {bubbles: true}))", procedure)
    for name, value in parameters.items():
        operator.script("document.querySelector(`#run-parameters input[name=${arguments[0]}]`).value = arguments[1]",
                        name, value)
    operator.click("#run-start")
    assert procedure in operator.say_yes()
    operator.until_procedure("running", 90)


def drive(cell):
    operator = Viewer(console_address(cell))
    operator.until("every node", lambda: operator.length("nodes") >= 8, 30)
    assert "Nobody" in operator.text("#control-word")
    begin(operator, "approach.yaml", speed="15 mm/s")

    # It approaches: estimate and truth come nearer, the plots grow.
    operator.until("the approach", lambda: operator.data("#steps li[data-state=running]", "step") == "4", 120)
    operator.until("a good estimate", lambda: operator.data("#estimate", "status") == "ok", 30)
    before, samples = operator.section("frames"), operator.length("samples")
    operator.until("the replica and its ghost move", lambda: all(
        distance(before[name], operator.section("frames")[name]) > 0.05 for name in ("replica", "ghost")), 30)
    operator.until("plots grow", lambda: operator.length("samples") >= samples + 2, 30)
    frames = operator.section("frames")
    assert distance(frames["replica"], frames["ghost"]) < 0.05, "the ghost is elsewhere"
    time.sleep(4)
    operator.picture("console.png")

    # Held: the arms stand still. Resumed only after confirmation.
    operator.click("#hold")
    operator.until_procedure("held", 10)
    operator.until("the word for it", lambda: operator.data("#state", "state") == "held", 5)
    time.sleep(2.5)
    there = joints(operator)
    time.sleep(2)
    assert max(abs(a - b) for a, b in zip(there, joints(operator))) < 2e-4, "the arms move on hold"
    operator.use("#resume", lambda: operator.is_open("#confirm-dialog"))
    assert operator.data("#running", "procedureState") == "held"
    assert "approach" in operator.say_yes()
    operator.until_procedure("running", 10)

    # Another viewer takes control over, and aborts.
    second = Viewer(console_address(cell))
    operator.steer()
    second.until("whose it is", lambda: second.body("control") == "other", 10)
    second.click("#take-control")
    assert "lose it" in second.say_yes()
    second.until("control", second.has_control, 20)
    operator.until("control lost", lambda: operator.body("control") == "other", 10)
    second.abort("enough seen")
    for viewer in (second, operator):
        viewer.until_procedure("finished", 90)
        assert viewer.data("#running", "outcome") == "aborted", viewer.data("#running", "outcome")
    assert "enough seen" in second.script("return document.querySelector('#events').textContent")
    second.close()
    operator.close()


# The emergency stop is pressed while the arms move, and let go again.
alarm = """name: alarm
layout: range
steps:
  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 200 mm/s, turn: 10 deg/s}
  - inject: {device: plc, fault: estop, for: 15 s, after: 2 s}
  - move: {to: [200, -100, 4500, 5, 15, -10], speed: 50 mm/s, turn: 5 deg/s}
"""


def recover(cell):
    """After an alarm: a reset is refused while the stop is in, then it clears the alarm, and the run goes on."""
    operator = Viewer(console_address(cell))
    begin(operator, "alarm.yaml")
    operator.until_procedure("held", 90)
    operator.until("the stop", lambda: "E-stop" in operator.text("#state"), 5)
    operator.use("#reset", lambda: "SRVO-001" in operator.text("#notice"))
    assert operator.data("#running", "procedureState") == "held"
    operator.until("the stop is let go", lambda: "E-stop" not in operator.text("#state"), 30)
    assert "SRVO-001" in operator.text("#state"), operator.text("#state")
    operator.use("#reset", lambda: "resume goes on" in operator.text("#state"))
    assert operator.data("#running", "procedureState") == "held"
    operator.use("#resume", lambda: operator.is_open("#confirm-dialog"))
    operator.say_yes()
    operator.until_procedure("running", 10)
    operator.until_procedure("finished", 90)
    assert operator.data("#running", "outcome") == "pass", operator.data("#running", "outcome")
    operator.close()


def replay(run):
    process = subprocess.Popen([berth, "console", str(run), "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        address = next(re.search(r"http\S+", line) for line in process.stdout if "http" in line).group(0)
        viewer = Viewer(address)
        viewer.until("a replay", lambda: viewer.body("mode") == "replay" and viewer.section("replay").get("length_s"), 60)
        length = viewer.section("replay")["length_s"]
        assert length > 20, length
        if not viewer.section("replay")["paused"]:  # not as drawn: before the first drawing the bar shows paused
            viewer.click("#replay-play")
        viewer.until("paused", lambda: viewer.section("replay")["paused"], 10)
        viewer.until("drawn as paused", lambda: viewer.data("#replay-bar", "paused") == "true", 10)
        places = []
        for part in (0.03, 0.6):
            viewer.script("const s = document.querySelector('#replay-slider'); s.value = arguments[0];"
                          "for (const e of ['input', 'change']) s.dispatchEvent(new Event(e, {bubbles: true}))", part * length)
            viewer.until("sought", lambda: abs(viewer.section("replay")["position_s"] - part * length) < 0.5, 15)
            time.sleep(2)
            places.append(viewer.section("frames")["replica"])
        assert distance(*places) > 0.03, "the replica is where it was before"
        viewer.colours("dark")
        viewer.picture("console_replay.png")
        at = viewer.section("replay")["position_s"]
        viewer.click("#replay-play")
        viewer.until("it plays", lambda: viewer.section("replay")["position_s"] > at + 1, 15)
        viewer.close()
    finally:
        process.terminate()
        assert process.wait(10) == 0


def dark(cell):
    viewer = Viewer(console_address(cell))
    viewer.colours("dark")
    time.sleep(2)
    viewer.picture("console_dark.png")
    viewer.close()


def run_of(procedure):
    return next(directory for directory in sorted(runs.iterdir()) if directory.name.endswith("_" + procedure))


# The shipped procedures, and one more.
home = work / "home"
home.mkdir()
for shipped in pathlib.Path(os.environ["BERTH_HOME"]).iterdir():
    if shipped.name != "procedures":
        (home / shipped.name).symlink_to(shipped)
    else:
        shutil.copytree(shipped, home / shipped.name)
(home / "procedures" / "alarm.yaml").write_text(alarm)
os.environ["BERTH_HOME"] = str(home)

# A machine without a graphics card may keep a page busy for longer than control lasts: that must not hold the run here.
config = work / "config"
shutil.copytree(home / "config", config)
file = config / "console.yaml"
file.write_text(file.read_text().replace("on_loss_of_control: hold", "on_loss_of_control: nothing"))
subprocess.run([berth, "up", "--layout", "range", "--config", str(config), "--detach", "--out", str(runs), "--lcm-url", url],
               check=True)
os.nice(10)  # the browser's pixels are not to cost the cell its beat
cell = run_of("cell")
try:
    drive(cell)
    recover(cell)
    dark(cell)
finally:
    subprocess.run([berth, "stop", str(cell)], check=False)
run = run_of("approach")
for _ in range(100):
    if (run / "SHA256SUMS").exists():
        break
    time.sleep(0.2)
replay(run)
print("the console works in Chromium")
