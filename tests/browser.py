#!/usr/bin/env python3
# Opens reports in headless Chromium, as a person would: no error on the console, no request to anywhere, a click on a column's head sorts, the slider
# changes the frames.
#   tests/browser.py PROGRAM     makes a run and two studies in a folder of its own; exit 1 with a line for everything that is not so
import json
import os
import select
import subprocess
import sys
import tempfile
import time

SHOT = """
[shot]
frames = 3
[sim]
dimension = 2
domain = [[0, 0], [1, 0.5]]
cell = 0.05
[[body]]
name = "column"
shape = { box = [[0, 0], [0.3, 0.4]] }
[[effect]]
kind = "gravity"
[render]
width = 320
height = 192
"""


class Browser:
    """Chromium through its pipe of debugging messages: JSON texts, each ended by a zero byte."""

    def __init__(self, profile):
        to_child, own_out = os.pipe()
        own_in, from_child = os.pipe()

        def place():   # it reads from descriptor 3 and writes to 4; both may be taken by the other's end
            reading, writing = os.dup(to_child), os.dup(from_child)
            high_reading, high_writing = os.dup2(reading, 100), os.dup2(writing, 101)
            os.dup2(high_reading, 3, inheritable=True)
            os.dup2(high_writing, 4, inheritable=True)

        self.process = subprocess.Popen(
            ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--window-size=1280,900", "--user-data-dir=" + profile,
             "--remote-debugging-pipe", "about:blank"],
            preexec_fn=place, close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_child)
        os.close(from_child)
        self.into, self.out, self.buffer, self.number, self.events = own_out, own_in, b"", 0, []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = None
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")

    def receive(self, patience):
        end = time.monotonic() + patience
        while b"\0" not in self.buffer:
            ready, _, _ = select.select([self.out], [], [], max(0, end - time.monotonic()))
            if not ready:
                return None
            piece = os.read(self.out, 1 << 20)
            if not piece:
                sys.exit("chromium has ended")
            self.buffer += piece
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if getattr(self, "session", None):
            message["sessionId"] = self.session
        os.write(self.into, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive(60)
            if answer is None:
                sys.exit("chromium does not answer " + method)
            if answer.get("id") == self.number:
                if "error" in answer:
                    sys.exit(method + ": " + answer["error"]["message"])
                return answer["result"]
            self.events.append(answer)

    def open(self, path):
        self.events = []
        self.call("Page.navigate", url="file://" + path)
        while not any(e.get("method") == "Page.loadEventFired" for e in self.events):
            event = self.receive(60)
            if event is None:
                sys.exit(path + ": is not loaded after a minute")
            self.events.append(event)

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in result:
            sys.exit(expression + ": " + json.dumps(result["exceptionDetails"]))
        return result["result"].get("value")

    def click(self, selector):
        x, y = self.value("(() => { const e = document.querySelector(%s); e.scrollIntoView({block: 'center'}); const r = e.getBoundingClientRect();"
                          " return [r.x + r.width / 2, r.y + r.height / 2]; })()" % json.dumps(selector))
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def press(self, key):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode={"ArrowRight": 39, "Home": 36, "End": 35}[key])

    def close(self):
        os.close(self.into)
        try:
            self.process.wait(10)   # it ends when nobody speaks to it any more
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


failures = []


def expect(holds, what):
    if not holds:
        failures.append(what)


def column(browser, number):
    """What a reader sees in a column of the first table, as its cells' values or texts."""
    return browser.value("Array.from(document.querySelector('table').tBodies[0].rows, r => { const c = r.cells[%d];"
                         " return c.dataset.value !== undefined ? Number(c.dataset.value) : c.textContent; })" % number)


def check_console(browser, name):
    for event in browser.events:
        method, params = event.get("method"), event.get("params", {})
        bad = method == "Runtime.exceptionThrown" or (method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert")) or (
            method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"))
        expect(not bad, "%s: the console says %s" % (name, json.dumps(params)[:400]))
        if method == "Network.requestWillBeSent":
            url = params["request"]["url"]
            expect(url.startswith(("data:", "file://")), name + ": asks for " + url[:200])


def check_sorting(browser, name, head_number):
    """A click sorts a column of numbers upwards, another one downwards; cells without a number stay last."""
    head = "th:nth-child(%d)" % (head_number + 1)
    before = column(browser, head_number)
    expect(len(before) > 1, name + ": the table has %d rows" % len(before))
    for direction, sign in (("ascending", 1), ("descending", -1)):
        browser.click(head + " button")
        expect(browser.value("document.querySelector('%s').getAttribute('aria-sort')" % head) == direction, "%s: aria-sort is not %s" % (name, direction))
        after = column(browser, head_number)
        numbers = [v for v in after if not isinstance(v, str)]
        expect(numbers == sorted(numbers, key=lambda v: sign * v), "%s: not %s: %s" % (name, direction, after))
        expect(len(numbers) > 1, name + ": no numbers to sort")
        expect(all(isinstance(v, str) for v in after[len(numbers):]), name + ": cells without a number are not last")
        expect(sorted(map(str, after)) == sorted(map(str, before)), name + ": sorting has lost rows")
    expect(browser.value("document.querySelectorAll('th[aria-sort=none]').length") == browser.value("document.querySelectorAll('th').length") - 1,
           name + ": more than one column says that it is sorted")


def shown(browser):
    """Frames that each strip shows, and what the slider says."""
    return browser.value("[Array.from(document.querySelectorAll('.strip'), s => Array.from(s.querySelectorAll('[data-frame]')).filter(f => f.offsetParent !== null)"
                         ".map(f => Number(f.dataset.frame)).join()), document.querySelector('.controls output').textContent]")


def check_scrubber(browser, name):
    frames = 1 + int(browser.value("document.querySelector('.controls input').max"))
    expect(frames > 1, name + ": one frame only")
    strips, said = shown(browser)
    expect(len(strips) > 1 and all(s == str(frames - 1) for s in strips), name + ": does not begin with the last frame of every strip: %s" % strips)
    said_of = set([said])
    browser.click(".controls input")   # the middle of the slider
    strips, _ = shown(browser)
    expect(all(s == str(frames // 2) for s in strips), name + ": a click on the slider's middle shows %s" % strips)
    for key, frame in (("Home", 0), ("ArrowRight", 1), ("End", frames - 1)):
        browser.press(key)
        strips, said = shown(browser)
        said_of.add(said)
        expect(all(s == str(frame) for s in strips), "%s: the key %s shows %s" % (name, key, strips))
    expect(len(said_of) > 1, name + ": always says " + said)
    expect(browser.value("Array.from(document.querySelectorAll('.strip img')).every(i => i.complete && i.naturalWidth > 100)"), name + ": a picture is broken")


def main():
    program = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        with open(folder + "/x.toml", "w") as shot:
            shot.write(SHOT)
        cheap = ["--repeats", "1", "--quiet"]
        for words in (["run", "x.toml", "--quiet", "--out", "run"],
                      ["cost", "taylor_green_2d", "--vary", "sim.transfer=pic,apic", "--out", "problem"] + cheap,
                      ["cost", "x.toml", "--vary", "sim.transfer=pic,apic", "--frames", "1-3", "--out", "shot"] + cheap):
            done = subprocess.run([program] + words, cwd=folder, stdout=subprocess.DEVNULL)
            if done.returncode != 0:
                sys.exit("polypic %s: exit code %d" % (" ".join(words), done.returncode))
        browser = Browser(folder + "/profile")
        try:
            for name, head in (("run", 2), ("problem", 3), ("shot", 2)):
                browser.open("%s/%s/report.html" % (folder, name))
                expect(browser.value("document.querySelectorAll('figure > svg').length") > 1, name + ": no plots")
                expect(browser.value("document.documentElement.scrollWidth <= window.innerWidth"), name + ": wider than the window")
                check_sorting(browser, name, head)
                if name == "shot":
                    check_scrubber(browser, name)
                check_console(browser, name)
        finally:
            browser.close()
    for failure in failures:
        print(failure)
    print("%d pages opened, %d complaints" % (3, len(failures)))
    return 1 if failures else 0


sys.exit(main())
