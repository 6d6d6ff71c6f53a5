# SPDX-License-Identifier: BSD-3-Clause
"""Drives the cell of console.sh: console_control.py PORT."""
import sys
import urllib.error
import urllib.request

from page_client import Page

HELD, TEARDOWN, FINISHED, ABORTED = 2, 4, 5, 3
port = int(sys.argv[1])


def state(page):
    value = page.get("procedure").get("state", -1)
    words = ["preparing", "running", "held", "prompting", "teardown", "finished"]
    return words.index(value) if isinstance(value, str) else value


page = Page(port)
page.until(lambda: page.hello and {"scene", "frames", "nodes", "procedures", "control", "safe"} <= page.sections.keys(), 20,
           "the board")
assert page.hello["mode"] == "live" and page.hello["may_command"], page.hello
page.until(lambda: len(page.get("nodes")) >= 7, 20, "every node")
mesh = next(body["mesh"] for body in page.get("scene")["bodies"] if body.get("mesh"))
with urllib.request.urlopen(f"http://localhost:{port}{mesh}") as reply:
    assert b"positions" in reply.read()

# Foreign pages, and what is no command.
try:
    Page(port, origin="http://elsewhere.example")
    raise AssertionError("a foreign origin is served")
except ConnectionError as refusal:
    assert "403" in str(refusal), refusal
for text in ("{", '{"type": "command"}', '{"type": "command", "id": 1, "command": "hold", "arguments": [[[[]]]]}'):
    rude = Page(port)
    rude.until(lambda: rude.hello, 5, "hello")
    rude.send_text(text)
    try:
        rude.until(lambda: any(not a["accepted"] for a in rude.answers.values()), 5, "a refusal")
    except ConnectionError:
        pass
    rude.close()

# Control is free: nothing is obeyed.
assert page.request("lamps", sun=0.5)["text"] == "take control first"
assert "not known" in page.request("fly")["text"]
assert page.request("take_control")["accepted"]
page.until(page.mine, 5, "control")
assert page.request("lamps", sun=0.5)["accepted"]
page.until(lambda: abs(page.get("facility").get("sun_lamp", 0) - 0.5) < 0.05, 10, "the lamp")
assert not page.request("run", procedure="../config/testbed.yaml")["accepted"]

# A procedure, from the page.
page.request_and_confirm("run", procedure="free_pose.yaml", parameters={"survey": "60 s", "returns": "500"})
page.until(lambda: state(page) == 1, 60, "a procedure that runs")
page.until(page.mine, 10, "control of the procedure")
page.until(lambda: page.get("procedure")["current_step"] >= 1, 60, "the second step")
other = Page(port)
other.until(lambda: other.hello, 10, "a second viewer")
assert "has control" in other.request("abort", reason="mine")["text"]
assert other.request("hold")["accepted"], "a hold is obeyed from every viewer"
page.until(lambda: state(page) == HELD, 10, "held")
assert not page.request("resume", "yes-0")["accepted"]
page.listen(2)  # to rest
confirmed = page.request_and_confirm("resume")
assert "free_pose" in confirmed["text"], confirmed
page.until(lambda: state(page) == 1, 10, "resumed")

# The second viewer takes over, and is lost: the procedure is held, and control is free.
other.request_and_confirm("take_control")
page.until(lambda: not page.mine(), 5, "control taken over")
assert "has control" in page.request("abort", reason="mine")["text"]
other.close()
page.until(lambda: state(page) == HELD, 10, "held when its operator is lost")
page.until(lambda: not page.get("control")["holder"], 5, "control lapsed")
assert page.request("take_control")["accepted"]
assert page.request("abort", reason="enough")["accepted"]
page.until(lambda: state(page) == FINISHED, 60, "finished")
outcome = page.get("procedure")["outcome"]
assert outcome in (ABORTED, "aborted"), outcome
print("the console shows and drives")
