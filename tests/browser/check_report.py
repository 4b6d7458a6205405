"""Opens a report in a browser as a person would, operates its controls, and says what does not work.

    tests/browser/python tests/browser/check_report.py REPORT.html [--pictures DIR]

Needs Chromium and its driver (Debian: apt-get install chromium chromium-driver). Prints one line per check; ends with
exit code 1 when one failed. Every control must change exactly the pictures that depend on it: which those are stands in
`DEPENDENTS`, apart from the page's own opinion.
"""

import argparse
import base64
import json
import shutil
import sys
import tempfile
import time
from pathlib import Path

from selenium import webdriver
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

SIZES = [(1280, 900), (390, 844)]
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
).split()

# Chromium does not draw taller pictures than this.
TALLEST_PX = 16_000

RELIABILITY = {"fig-orientation", "fig-altitude", "fig-catchment", "fig-gamma"}
COLORED = {"fig-scatter", "fig-clusters-map"}
SILHOUETTES = {"fig-silhouettes", "fig-silhouette-curves"}
VARIANCE = {"fig-variance-blurs", "fig-variance-scales"}
LANDMARKS = {"fig-landmarks", "fig-selections"}
MATRICES = {"fig-distances pixels", "fig-profiles pixels"}
OF_A_CELL = (
    VARIANCE | MATRICES | LANDMARKS | RELIABILITY | COLORED | SILHOUETTES
    | {"fig-eigenimages", "fig-recovered", "fig-distances-strip pixels", "fig-profiles-sorted", "fig-dendrogram"}
    | {"fig-localization"}
)
# Pictures that a control changes. Matrices are told apart from what is drawn over them: their pixels have names of
# their own.
DEPENDENTS = {
    "scale": OF_A_CELL,
    "blur": OF_A_CELL | {"reliability-legend"},
    "method": LANDMARKS | RELIABILITY | {"method-about"},
    "dims": VARIANCE | LANDMARKS | RELIABILITY | COLORED | SILHOUETTES
    | {"fig-distances pixels", "fig-distances-strip", "fig-profiles", "fig-profiles-sorted", "fig-dendrogram"},
    "criterion": RELIABILITY | {"fig-segmentation"},
    "lattice": {"fig-views"},
    "against": RELIABILITY,
    "compare": RELIABILITY | {"reliability-legend"},
    "linkage": COLORED | {"fig-dendrogram"},
    "clusters": COLORED | {"fig-dendrogram"},
    "alone": {"fig-clusters-map"},
    "by": COLORED,
    "cut": SILHOUETTES,
    "landmark": {"fig-localization"},
}
# A cut of k-means is on the map only while k-means colors it.
DEPENDENTS_BY_K_MEANS = {"cut": SILHOUETTES | COLORED, "alone": {"fig-clusters-map"}}
# Blurs may differ, and pictures of them change, though not in which cells have data: these need some.
MAY_STAY = {"scale": {"fig-localization"}, "blur": {"fig-localization"}}

# What every picture looks like, as short text, without marks of the view that is pointed at and without readouts.
LOOKS = """
const digest = (text) => { let h = 5381; for (let i = 0; i < text.length; i++) h = (h * 33 ^ text.charCodeAt(i)) | 0; return `${text.length}:${h}`; };
const looks = {};
for (const host of document.querySelectorAll('section:not([hidden]) [id^="fig-"], #reliability-legend, #method-about')) {
  if (!host.checkVisibility()) continue;
  const drawn = host.cloneNode(true);
  drawn.querySelectorAll('.readout, .facts, .ring').forEach((element) => element.remove());
  drawn.querySelectorAll('[aria-label]').forEach((element) => element.removeAttribute('aria-label'));
  drawn.querySelectorAll('[class~="chosen"]').forEach((element) => element.classList.remove('chosen'));
  looks[host.id] = digest(drawn.innerHTML.replaceAll(' class=""', ''));
  const canvases = [...host.querySelectorAll('canvas')];
  if (canvases.length) looks[host.id + ' pixels'] = digest(canvases.map((canvas) => canvas.toDataURL()).join());
}
return looks;
"""

# Pairs of texts in one drawing, or of controls, that lie over each other.
OVERLAPS = """
const found = [];
const shrunk = (r) => ({ left: r.left + r.width * .04 + .5, right: r.right - r.width * .04 - .5, top: r.top + r.height * .18, bottom: r.bottom - r.height * .18 });
const over = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
const compare = (where, named) => {
  const boxes = named.map(([name, box]) => [name, shrunk(box)]).filter(([, box]) => box.right > box.left && box.bottom > box.top);
  boxes.sort((a, b) => a[1].left - b[1].left);
  for (let i = 0; i < boxes.length; i++)
    for (let j = i + 1; j < boxes.length && boxes[j][1].left < boxes[i][1].right; j++)
      if (over(boxes[i][1], boxes[j][1])) found.push(`${where}: ${boxes[i][0]} / ${boxes[j][0]}`);
};
const nameOf = (element) => element.closest('[id]')?.id ?? element.tagName;
for (const drawing of document.querySelectorAll('section:not([hidden]) svg')) {
  if (!drawing.checkVisibility()) continue;
  const texts = [...drawing.querySelectorAll('text')];
  compare(nameOf(drawing), texts.map((text) => [text.textContent, text.getBoundingClientRect()]));
  const frame = drawing.getBoundingClientRect();
  for (const text of texts) {
    const box = shrunk(text.getBoundingClientRect());
    if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1 || box.bottom > frame.bottom + 1)
      found.push(`${nameOf(drawing)}: ${text.textContent} is cut off`);
  }
}
for (const group of document.querySelectorAll('.bar, .tools, .legend')) {
  if (!group.checkVisibility()) continue;
  const parts = [...group.querySelectorAll('select, input[type=range], .only')].filter((part) => part.checkVisibility()).map((part) => [part.name || part.textContent, part.getBoundingClientRect()]);
  const walker = document.createTreeWalker(group, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || parent.closest('select, .only, .unseen') || !parent.checkVisibility()) continue;
    const range = document.createRange();
    range.selectNodeContents(walker.currentNode);
    parts.push([walker.currentNode.data.trim(), range.getBoundingClientRect()]);
  }
  compare('controls', parts);
}
return found;
"""

# Drawings and canvases without anything in them, and pictures that do not load.
EMPTY = """
const found = [];
const shapes = 'path, line, rect, circle, polyline, polygon, text, image';
const uris = new Set();
for (const drawing of document.querySelectorAll('section:not([hidden]) svg')) {
  if (!drawing.checkVisibility()) continue;
  const box = drawing.getBoundingClientRect();
  const name = drawing.closest('[id]')?.id;
  if (!drawing.querySelector(shapes) || box.width < 5 || box.height < 5) found.push(`svg in ${name}`);
  if (drawing.matches('.plot')) {
    const lines = [...drawing.querySelectorAll('.curve')];
    if (lines.length && !lines.some((line) => line.getAttribute('d'))) found.push(`curves in ${name}`);
    if (lines.some((line) => getComputedStyle(line).fill !== 'none')) found.push(`filled curves in ${name}`);
    if (/NaN|Infinity|undefined/.test(drawing.innerHTML)) found.push(`numbers in ${name}`);
  }
  drawing.querySelectorAll('image').forEach((picture) => uris.add(picture.getAttribute('href')));
  const behind = getComputedStyle(drawing).backgroundImage.match(/^url\\("(.*)"\\)$/);
  if (drawing.matches('.aerial') && !behind) found.push(`map in ${name}`);
  if (behind) uris.add(behind[1]);
}
for (const canvas of document.querySelectorAll('section:not([hidden]) canvas')) {
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  if (!data.some((value, i) => value !== data[i % 4])) found.push(`canvas in ${canvas.closest('[id]')?.id}`);
}
for (const host of document.querySelectorAll('section:not([hidden]) figure[id]')) {
  if (host.checkVisibility() && !host.children.length) found.push(host.id);
}
document.querySelectorAll('section:not([hidden]) img').forEach((picture) => uris.add(picture.src));
const done = arguments[0];
const load = (uri) => new Promise((resolve) => { const picture = new Image(); picture.onload = () => resolve(); picture.onerror = () => { found.push(`picture ${uri.slice(0, 40)}`); resolve(); }; picture.src = uri; });
Promise.all([...uris].map(load)).then(() => done(found));
"""

NAMELESS = """
const named = (element) => element.ariaLabel || element.labels?.[0]?.textContent.trim() || element.closest('fieldset')?.querySelector('legend')?.textContent;
const controls = [...document.querySelectorAll('select, input, button')].filter((element) => element.checkVisibility() && !named(element) && !element.textContent.trim());
const drawings = [...document.querySelectorAll('section:not([hidden]) [role=img]')].filter((element) => !element.ariaLabel && !element.closest('[aria-hidden=true], button'));
const bare = [...document.querySelectorAll('section:not([hidden]) svg')].filter((element) => !element.ariaLabel && !element.closest('[aria-hidden=true]'));
return [...controls, ...drawings, ...bare].map((element) => `${element.tagName} ${element.name || element.closest('[id]')?.id}`);
"""


class Checks:
    """Lines of the outcome, and their count."""

    def __init__(self):
        self.passed = self.failed = 0

    def check(self, what, problems):
        """Passes when there are no problems."""
        problems = list(problems)
        if problems:
            self.failed += 1
            more = f" (and {len(problems) - 5} more)" if len(problems) > 5 else ""
            print(f"FAIL  {what}: {'; '.join(map(str, problems[:5]))}{more}", flush=True)
        else:
            self.passed += 1
            print(f"ok    {what}", flush=True)


class Page:
    """A report in a browser of one size."""

    def __init__(self, report, size):
        self.url = Path(report).resolve().as_uri()
        self.size = size
        self.profile = tempfile.TemporaryDirectory(prefix="report-")
        options = webdriver.ChromeOptions()
        for flag in [*FLAGS, f"--user-data-dir={self.profile.name}"]:
            options.add_argument(flag)
        options.binary_location = tool("chromium")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(tool("chromedriver")))
        width, height = size
        # A window is never as narrow as a phone.
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.driver.quit()
        self.profile.cleanup()

    def open(self, address=""):
        # Another fragment alone would not load the page again.
        self.driver.get("about:blank")
        self.driver.get(self.url + address)

    def run(self, script, *values):
        return self.driver.execute_script(script, *values)

    def one(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def shown(self, selector):
        return [element for element in self.driver.find_elements(By.CSS_SELECTOR, selector) if element.is_displayed()]

    def looks(self):
        return self.run(LOOKS)

    def console(self):
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]

    def requests(self):
        """What was asked for beside the page itself and what is inside of it."""
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                url = message["params"]["request"]["url"]
                if message["params"]["documentURL"].startswith("chrome://"):
                    # The browser's own first tab.
                    continue
                if not url.startswith(("data:", "blob:", "about:")) and url.split("#")[0] != self.url:
                    yield url[:120]

    def scroll_to(self, element):
        self.run("arguments[0].scrollIntoView({block: 'center'})", element)

    def screenshot(self, path, element=None):
        box = self.run(
            "const r = (arguments[0] ?? document.documentElement).getBoundingClientRect();"
            "return {x: r.x + scrollX, y: r.y + scrollY, width: r.width, height: r.height}",
            element,
        )
        clip = {**box, "scale": min(1, TALLEST_PX / box["height"])}
        taken = self.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": clip})
        Path(path).write_bytes(base64.b64decode(taken["data"]))


def tool(name):
    path = shutil.which(name)
    if not path:
        sys.exit(f"{name} is missing: expected it in PATH (Debian: apt-get install chromium chromium-driver)")
    return path


class Control:
    """One control of the page, operated with mouse and keyboard."""

    def __init__(self, page, name):
        self.page, self.name = page, name
        self.elements = page.shown(f'[name="{name}"]')
        if not self.elements:
            # Radio buttons lie invisibly over their texts.
            self.elements = [
                element
                for element in page.driver.find_elements(By.CSS_SELECTOR, f'input[type=radio][name="{name}"]')
                if page.run("return arguments[0].parentElement.checkVisibility()", element)
            ]

    def exists(self):
        return bool(self.elements)

    def kind(self):
        element = self.elements[0]
        return "select" if element.tag_name == "select" else element.get_attribute("type")

    def value(self):
        if self.kind() == "radio":
            return next(element.get_attribute("value") for element in self.elements if element.is_selected())
        return self.elements[0].get_attribute("value")

    def values(self):
        """What can be chosen; of a slider at most eight places."""
        if self.kind() == "select":
            return [option.get_attribute("value") for option in Select(self.elements[0]).options]
        if self.kind() == "radio":
            return [element.get_attribute("value") for element in self.elements]
        most = int(self.elements[0].get_attribute("max"))
        return [str(place) for place in sorted({round(most * share / 7) for share in range(8)})]

    def choose(self, value):
        self.page.scroll_to(self.elements[0])
        if self.kind() == "select":
            Select(self.elements[0]).select_by_value(value)
        elif self.kind() == "radio":
            next(e for e in self.elements if e.get_attribute("value") == value).find_element(By.XPATH, "..").click()
        else:
            steps = int(value) - int(self.value())
            self.elements[0].send_keys((Keys.ARROW_RIGHT if steps > 0 else Keys.ARROW_LEFT) * abs(steps))
        if self.value() != value:
            raise RuntimeError(f"{self.name} is {self.value()} after choosing {value}")


def check_still(page, checks, at):
    """What can be seen without touching anything."""
    width, height = page.size
    checks.check(f"{at}: no horizontal overflow", overflow(page))
    checks.check(f"{at}: nothing overlaps", page.run(OVERLAPS))
    checks.check(f"{at}: nothing is empty", page.driver.execute_async_script(EMPTY))
    checks.check(f"{at}: controls and pictures have names", page.run(NAMELESS))
    page.run("scrollTo(0, document.documentElement.scrollHeight / 2)")
    bar = page.run("return document.getElementById('bar').getBoundingClientRect().toJSON()")
    problems = [] if abs(bar["top"]) < 1 else [f"the bar is at {bar['top']} px"]
    if bar["height"] > height / 3:
        problems.append(f"the bar covers {bar['height']:.0f} of {height} px")
    checks.check(f"{at}: the bar stays in sight and covers at most a third", problems)


def overflow(page):
    wide = page.run("return document.documentElement.scrollWidth")
    return [] if wide <= page.size[0] else [f"{wide} px wide at {page.size[0]}"]


def check_control(page, checks, at, name, dependents):
    """Goes through the values of a control: together they change every dependent picture and never another."""
    control = Control(page, name)
    if not control.exists():
        return
    first = control.value()
    present = set(page.looks())
    changed, overlapping, slowest = set(), [], 0.0
    for value in [*[value for value in control.values() if value != first], first]:
        before = page.looks()
        control.choose(value)
        after = page.looks()
        changed |= {picture for picture in before.keys() | after.keys() if before.get(picture) != after.get(picture)}
        overlapping += [f"{value}: {pair}" for pair in page.run(OVERLAPS) + overflow(page)]
    wanted = dependents & present
    # Matrices are replaced by words where nothing was computed, and come back.
    strangers = {picture for picture in changed - dependents if f"{picture} pixels" not in dependents}
    unmoved = wanted - changed - MAY_STAY.get(name, set())
    checks.check(
        f"{at}: {name} changes exactly its pictures ({len(wanted & changed)})",
        [f"{picture} did not change" for picture in sorted(unmoved)]
        + [f"{picture} changed" for picture in sorted(strangers)],
    )
    checks.check(f"{at}: nothing overlaps while {name} is changed", overlapping)


def check_pointing(page, checks, at):
    """A view that is pointed at is marked everywhere; a pair of the matrix is described."""
    view = page.one("#fig-views rect[data-view]:nth-of-type(3)")
    page.scroll_to(view)
    ActionChains(page.driver).move_to_element(view).perform()
    number = view.get_attribute("data-view")
    problems = [] if f"View {number}," in page.one("#selected").text else ["it is not described"]
    marked = page.run("return [...document.querySelectorAll('.chosen')].map((element) => element.dataset.view)")
    problems += [f"view {other} is marked, too" for other in marked if other != number]
    for picture in ["fig-views", "fig-distances", "fig-profiles", "fig-scatter", "fig-dendrogram", "fig-clusters-map"]:
        here = page.shown(f"#{picture} [data-view]")
        if here and not page.driver.find_elements(By.CSS_SELECTOR, f"#{picture} .chosen"):
            problems.append(f"not marked in {picture}")
    checks.check(f"{at}: a view that is pointed at is marked everywhere", problems)

    matrix = page.one("#fig-distances canvas")
    page.scroll_to(matrix)
    ActionChains(page.driver).move_to_element_with_offset(matrix, 30, -20).perform()
    said = page.one("#pair").text
    checks.check(f"{at}: the distance matrix says views and value", [] if "nSSD 0." in said else [said])

    plot = page.one("#fig-variance-blurs svg")
    page.scroll_to(plot)
    ActionChains(page.driver).move_to_element(plot).perform()
    said = page.one("#fig-variance-blurs .readout").text
    checks.check(f"{at}: a plot says its nearest point", [] if "dimensions" in said else [f"it says '{said}'"])


def check_keyboard(page, checks, at):
    """Arrow keys walk through the views, and every control can be reached."""
    drawing = page.one("#fig-views svg")
    before = page.one("#selected").text
    page.run("arguments[0].focus()", drawing)
    ActionChains(page.driver).send_keys(Keys.ARROW_RIGHT).perform()
    checks.check(f"{at}: arrow keys walk through the views", [] if page.one("#selected").text != before else [before])
    page.run("document.activeElement.blur(); scrollTo(0, 0)")
    reached = set()
    for _ in range(60):
        ActionChains(page.driver).send_keys(Keys.TAB).perform()
        reached.add(page.run("return document.activeElement.name ?? ''"))
    names = {name for name in ["scale", "blur", "method", "dims", "criterion"] if Control(page, name).exists()}
    checks.check(f"{at}: the tab key reaches every control of the bar", sorted(names - reached))


def check_address(page, checks, at, data):
    """What is chosen can be linked; what is not offered is ignored."""
    cell = data["cells"][-1]
    wanted = {
        "scale": str(cell["scale"]), "blur": cell["blur"], "dims": str(cell["dims"][0]),
        "method": data["methods"][-1]["id"], "criterion": "guaranteed",
    }
    page.open("#" + "&".join(f"{key}={value}" for key, value in wanted.items()))
    problems = []
    for name, value in wanted.items():
        control = Control(page, name)
        if control.exists():
            shown = page.one("#dims-shown").text if name == "dims" else control.value()
            if shown != value:
                problems.append(f"{name} is {shown} instead of {value}")
    control = Control(page, "dims")
    if control.exists():
        control.choose(control.values()[-1])
        time.sleep(0.5)
        address = page.run("return location.hash")
        problems += [f"{part} is not in {address}" for part in (f"dims={cell['dims'][-1]}", "criterion=") if part not in address]
    checks.check(f"{at}: the address holds what is chosen", problems)
    page.open("#scale=-7&blur=constructor&dims=many&method=%00&criterion=&clusters=1e9&__proto__=1&alone=x")
    empty = page.driver.execute_async_script(EMPTY)
    checks.check(f"{at}: an address that makes no sense is ignored", page.console() + empty)


def check_claims(page, checks, at):
    """Plots under the claims appear when they are opened."""
    opened = page.shown("details > summary")
    if not opened:
        return
    for summary in opened:
        page.scroll_to(summary)
        summary.click()
    plots = page.run("return document.querySelectorAll('details[open] svg.plot').length")
    problems = [] if plots >= len(opened) else [f"{plots} plots in {len(opened)} claims"]
    checks.check(f"{at}: claims show their plots", problems + page.run(OVERLAPS) + page.driver.execute_async_script(EMPTY))


def check_absent_cell(page, checks, at, data):
    """A scale and blur without a cell says so."""
    present = {(cell["scale"], cell["blur"]) for cell in data["cells"]}
    absent = [(scale, blur) for scale in data["scales"] for blur in data["blurs"] if (scale, blur) not in present]
    if not absent:
        return
    scale, blur = absent[0]
    page.open(f"#scale={scale}&blur={blur}")
    said = page.one("#fig-distances").text
    checks.check(f"{at}: what was not computed says so", [] if "not computed" in said else [said])
    checks.check(f"{at}: nothing is empty or in error there", page.console() + page.driver.execute_async_script(EMPTY))


def check_controls(page, checks, at, data):
    selected = {tuple(landmarks) for cell in data["cells"] for landmarks in cell["selected"]}
    # The landmarks of one atlas are the same in all dimensions.
    fixed = {"fig-landmarks"} if len(selected) == 1 else set()
    for name in ["scale", "blur", "dims", "method", "criterion", "lattice", "against", "compare"]:
        check_control(page, checks, at, name, DEPENDENTS[name] - (fixed if name == "dims" else set()))
    cell = next((cell for cell in data["cells"] if cell["clusters"]), None)
    if cell:
        page.open(f"#scale={cell['scale']}&blur={cell['blur']}")
        for name in ["linkage", "clusters", "alone", "cut", "by"]:
            check_control(page, checks, at, name, DEPENDENTS[name])
        Control(page, "by").choose("k-means")
        for name, dependents in DEPENDENTS_BY_K_MEANS.items():
            check_control(page, checks, f"{at}, by k-means", name, dependents)
    several = [cell for cell in data["cells"] if len({entry["landmark"] for entry in cell["localization"]}) > 1]
    if several:
        page.open(f"#scale={several[0]['scale']}&blur={several[0]['blur']}")
        check_control(page, checks, at, "landmark", DEPENDENTS["landmark"])


def take_pictures(page, folder):
    folder.mkdir(parents=True, exist_ok=True)
    page.run("scrollTo(0, 0)")
    width, _ = page.size
    page.screenshot(folder / f"page-{width}.png")
    # The bar would lie over the tops of sections.
    page.run("document.getElementById('bar').style.position = 'static'")
    for section in page.shown("section[id]"):
        page.screenshot(folder / f"{section.get_attribute('id')}-{width}.png", section)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("report", type=Path)
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="writes pictures of the page and its sections")
    options = parser.parse_args()
    if not options.report.is_file():
        parser.error(f"{options.report} is missing: expected a report in HTML")
    checks = Checks()
    for size in SIZES:
        at = f"{size[0]}×{size[1]}"
        with Page(options.report, size) as page:
            page.open()
            data = page.run(
                "const data = JSON.parse(document.getElementById('data').textContent);"
                "return {scales: data.scales, blurs: data.blurs, methods: data.methods, cells: data.cells.map("
                "({scale, blur, dims, clusters, localization, tables}) => ({scale, blur, dims, clusters: !!clusters,"
                " selected: Object.values(tables).flat().filter((table) => table).map(({landmarks}) => landmarks),"
                " localization: localization.map(({landmark}) => ({landmark}))}))}"
            )
            if options.pictures:
                take_pictures(page, options.pictures)
                page.open()
            check_still(page, checks, at)
            check_pointing(page, checks, at)
            check_keyboard(page, checks, at)
            check_controls(page, checks, at, data)
            page.open()
            check_claims(page, checks, at)
            checks.check(f"{at}: no errors in the console", page.console())
            check_absent_cell(page, checks, at, data)
            check_address(page, checks, at, data)
            checks.check(f"{at}: nothing is fetched", page.requests())
    print(f"{checks.passed} passed, {checks.failed} failed")
    return 1 if checks.failed else 0


if __name__ == "__main__":
    sys.exit(main())
