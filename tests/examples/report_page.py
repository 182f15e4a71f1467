#!/usr/bin/env python3
"""Opens the page of nook-report in headless Chromium and uses it.

    report_page.py PAGE [FOLDER]

Needs selenium, chromium and chromedriver. Writes light.png, dark.png, phone.png, print.pdf and
print.png into FOLDER, if there is one. Says what is wrong and exits with 1; exits with 0 otherwise.
"""

import base64
import json
import pathlib
import shutil
import sys
import time

from selenium import webdriver
from selenium.common.exceptions import WebDriverException
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

LONGEST_SHOT = 16000  # pixels; Chromium's pictures of longer pages come out empty


class Wrong(Exception):
    """A claim about the page that does not hold; the text says which."""


def check(holds, claim):
    if not holds:
        raise Wrong(claim)


def program(*names):
    for name in names:
        path = shutil.which(name)
        if path:
            return path
    raise Wrong(f"none of {', '.join(names)} is installed")


class Page:
    def __init__(self, path, folder):
        self.address, self.folder = path.resolve().as_uri(), folder
        options = Options()
        options.binary_location = program("chromium", "chromium-browser", "google-chrome")
        for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage",
                         "--hide-scrollbars", "--force-color-profile=srgb"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(program("chromedriver")))
        self.driver.set_page_load_timeout(120)
        self.driver.set_script_timeout(60)
        self.requests, self.complaints = [], []

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def until(self, script, claim, *arguments):
        """Waits until a script returns something true, and returns that."""
        end = time.monotonic() + 20
        while time.monotonic() < end:
            value = self.js(script, *arguments)
            if value:
                return value
            time.sleep(0.05)
        raise Wrong(claim)

    def size(self, width, height=900, mobile=False):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile})
        # On a phone the window grows with a page that is too wide for it: check_width says so.
        self.until("return innerWidth === arguments[0] ||"
                   " document.documentElement.scrollWidth > arguments[0]",
                   f"the window is not {width} wide", width)
        # Two frames: the page draws its plot anew when its width changes.
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));")

    def media(self, kind="", **features):
        """Emulates; without motion unless told, so that what is clicked holds still."""
        features = {"prefers_reduced_motion": "reduce", **features}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "media": kind,
            "features": [{"name": name.replace("_", "-"), "value": value}
                         for name, value in features.items()]})

    def open(self):
        self.driver.get(self.address)
        self.until("return document.readyState === 'complete'", "the page does not finish loading")
        self.log()

    def log(self):
        """Collects what the browser complained about, and what was asked for over the network."""
        self.complaints += [entry["message"] for entry in self.driver.get_log("browser")]
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                self.requests.append(message["params"]["request"]["url"])

    def shoot(self, name, width, mobile=False):
        if self.folder is None:
            return
        # A page scrolled down keeps its place when the window grows.
        self.js("scrollTo(0, 0)")
        height = self.js("return document.documentElement.scrollHeight")
        self.size(width, min(height, LONGEST_SHOT), mobile)
        self.settle_pictures()
        shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})
        (self.folder / name).write_bytes(base64.b64decode(shot["data"]))
        self.size(width, mobile=mobile)

    def settle_pictures(self):
        self.until("return [...document.images].every((image) => image.complete)",
                   "pictures do not finish loading")

    def choose(self, name, value):
        """Chooses a radio button as a keyboard or a mouse would."""
        self.js("""
            const input = [...document.querySelectorAll(`input[name="${arguments[0]}"]`)]
                .find((one) => one.value === arguments[1]);
            if (!input) throw new Error(`no choice ${arguments[0]} = ${arguments[1]}`);
            input.click();""", name, value)


# --- what is checked ------------------------------------------------------------------------------


def check_plots(page, report):
    """Every result is a mark in the plot of its cell, its reference and each number of threads."""
    for cell in report["cells"]:
        page.choose("scene", cell["scene"])
        if sum(other["scene"] == cell["scene"] for other in report["cells"]) > 1:
            page.choose("radius", cell["id"])
        for meaning in {reference["meaning"] for reference in cell["references"]}:
            if len(cell["references"]) > 1:
                page.choose("meaning", meaning)
            for threads in thread_counts(report):
                if len(thread_counts(report)) > 1:
                    page.choose("threads", str(threads))
                expected = {result["id"] for result in cell["results"]
                            if result["meaning"] == meaning
                            and any(timing["threads"] == threads for timing in result["timings"])}
                shown = page.js("""return [...document.querySelectorAll("#canvas .mark")]
                    .map((mark) => mark.dataset.id);""")
                check(len(shown) == len(set(shown)) and set(shown) == expected,
                      f"{cell['id']}, {meaning}, {threads} threads: the plot shows {len(shown)} "
                      f"marks of {len(expected)} results")
                outside = page.js("""
                    const frame = document.querySelector("#canvas svg").getBoundingClientRect();
                    return [...document.querySelectorAll("#canvas .mark")].filter((mark) => {
                        const box = mark.getBoundingClientRect();
                        const x = (box.left + box.right) / 2, y = (box.top + box.bottom) / 2;
                        return !(x >= frame.left && x <= frame.right && y >= frame.top &&
                                 y <= frame.bottom);
                    }).map((mark) => mark.dataset.id);""")
                check(not outside, f"{cell['id']}: marks outside of the plot: {outside}")
                front = page.all("#canvas path.front")
                wanted = any(threads in result["pareto"] for result in cell["results"]
                             if result["meaning"] == meaning)
                check(bool(front) == wanted, f"{cell['id']}, {meaning}: the front is not marked")
        rows = page.js("return document.querySelectorAll('#results tbody tr').length")
        check(rows == len(cell["results"]),
              f"{cell['id']}: the table has {rows} rows of {len(cell['results'])} results")


def thread_counts(report):
    return sorted({timing["threads"] for cell in report["cells"]
                   for result in cell["results"] for timing in result["timings"]})


def check_measures(page):
    values = page.js("return [...document.querySelectorAll('input[name=measure]')]"
                     ".map((input) => input.value)")
    check(len(values) >= 3, f"only the errors {values} can be chosen")
    for value in values:
        page.choose("measure", value)
        check(page.all("#canvas .mark"), f"error {value}: no marks")
        check(page.js("""return [...document.querySelectorAll("#canvas .mark, #canvas path")]
            .every((node) => !/NaN|Infinity|undefined/.test(
                (node.getAttribute("transform") ?? "") + (node.getAttribute("d") ?? "")))"""),
              f"error {value}: marks at places that are no numbers")
    page.choose("measure", values[0])


def column_of(page, head):
    """The texts of a table's column as numbers, − for ASCII; None where there is none."""
    texts = page.js("""
        const head = arguments[0], at = head.cellIndex;
        return [...head.closest("table").tBodies[0].rows].map((row) => row.cells[at].innerText);
        """, head)
    values = []
    for text in texts:
        try:
            values.append(float(text.replace("−", "-").strip()))
        except ValueError:
            values.append(None)
    return values


def check_sorting(page):
    head = next((head for head in page.all("#results thead th")
                 if head.text.split("\n")[0].strip().startswith("RMSE")), None)
    check(head is not None, "the table of results has no column RMSE")
    button = head.find_element(By.TAG_NAME, "button")
    page.js("arguments[0].scrollIntoView({block: 'center'})", button)
    before = column_of(page, head)
    button.click()
    up = column_of(page, head)
    check(head.get_attribute("aria-sort") == "ascending", "no aria-sort after a click")
    check(up == sorted(before), "a click does not sort the column")
    button.send_keys(Keys.ENTER)
    down = column_of(page, head)
    check(head.get_attribute("aria-sort") == "descending", "no aria-sort after Enter")
    check(down == up[::-1], "the second time does not turn the order round")
    check(len(page.all("#results th[aria-sort]")) == 1, "more than one column is said to be sorted")
    # All tables: a click on each column, and what has no value stays last.
    bad = page.js("""
        const bad = [];
        for (const table of document.querySelectorAll("table.sheet"))
            for (const head of table.tHead.rows[0].cells) {
                const button = head.querySelector("button");
                const texts = () => [...table.tBodies[0].rows].map((r) => r.cells[head.cellIndex].innerText.trim());
                for (const order of ["ascending", "descending"]) {
                    button.click();
                    if (head.getAttribute("aria-sort") !== order) button.click();
                    const now = texts(), none = now.findIndex((text) => text === "–");
                    if (head.getAttribute("aria-sort") !== order) bad.push(head.innerText + ": " + order);
                    if (none >= 0 && now.slice(none).some((text) => text !== "–"))
                        bad.push(head.innerText + ": a value after none");
                }
            }
        return bad;""")
    check(not bad, f"tables do not sort: {bad[:5]}")


def check_plans(page, report, pictures):
    """What was left out: a row for each result that says so, and the plans in false colour."""
    for cell in report["cells"]:
        page.choose("scene", cell["scene"])
        if sum(other["scene"] == cell["scene"] for other in report["cells"]) > 1:
            page.choose("radius", cell["id"])
        rows = page.js("return document.querySelectorAll('#skipped-table tbody tr').length")
        skipped = ("skipped", "skipped_samples", "skipped_rays", "skipped_passes")
        wanted = sum(result["without"] is not None
                     or any(result["work"][name] > 0 for name in skipped)
                     for result in cell["results"])
        check(rows == wanted, f"{cell['id']}: {rows} rows of {wanted} that leave something out")
        planned = [result for result in cell["results"]
                   if result["plan"] and result["plan"]["tolerance"] == 0]
        cost = page.js("return document.querySelector('#planning-cost').innerText")
        for result in planned:
            check(f"% of {result['without']}" in cost,
                  f"{cell['id']}: no cost of planning {result['without']}: {cost}")
        if pictures:
            drawn = page.js("return document.querySelectorAll('#plan-pictures img').length")
            names = sum(bool(result["plan"] and result["plan"]["picture"])
                        for result in cell["results"])
            check(drawn == names, f"{cell['id']}: {drawn} pictures of {names} plans")
    cells = sum(any(result["plan"] for result in cell["results"]) for cell in report["cells"])
    rows = page.js("return document.querySelectorAll('#plans-table tbody tr').length")
    check(rows == cells, f"plans, scene by scene: {rows} rows of {cells} cells with plans")


def check_point(page, report):
    """A click on a mark, the slider, the error map."""
    mark = page.find("#canvas .mark")
    wanted = mark.get_attribute("data-id")
    page.js("arguments[0].scrollIntoView({block: 'center'})", mark)
    page.js("""const box = arguments[0].getBoundingClientRect();
        arguments[0].ownerSVGElement.dispatchEvent(new MouseEvent("click", {bubbles: true,
            clientX: (box.left + box.right) / 2, clientY: (box.top + box.bottom) / 2}));""", mark)
    chosen = page.find("#canvas .mark.chosen").get_attribute("data-id")
    result = next(r for cell in report["cells"] for r in cell["results"] if r["id"] == chosen)
    check(chosen == wanted or result, f"a click on {wanted} chooses {chosen}")
    check(result["kernel"] in page.find("#point h3").text,
          f"the panel does not show {result['kernel']}")
    check("nook-report" in page.find("#point .command").text, "no command line beside the numbers")


def check_slider(page):
    slider = page.find("#point .compare input[type=range]")
    image = page.find("#point .compare img.mine")
    page.js("arguments[0].scrollIntoView({block: 'center'})", slider)
    before = image.value_of_css_property("clip-path")
    slider.send_keys(Keys.ARROW_RIGHT * 5)
    by_key = image.value_of_css_property("clip-path")
    check(before != by_key, "arrow keys do not move the slider")
    # A press at a quarter of the width.
    box = page.js("const b = arguments[0].getBoundingClientRect(); return [b.x, b.y, b.width, b.height]",
                  slider)
    at = {"x": box[0] + box[2] / 4, "y": box[1] + box[3] / 2, "button": "left", "clickCount": 1}
    for kind in ("mousePressed", "mouseReleased"):
        page.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, **at})
    value = float(slider.get_property("value"))
    check(20 <= value <= 30, f"a press at a quarter of the picture moves the slider to {value}")
    check(image.value_of_css_property("clip-path") != by_key, "the picture is not cut at the slider")


def check_error_map(page):
    # Read from a copy: reading the canvas itself makes the browser complain.
    pixels = """
        const canvas = document.querySelector("#point .difference canvas");
        if (!canvas || !canvas.width) return 0;
        const copy = new OffscreenCanvas(canvas.width, canvas.height);
        const context = copy.getContext("2d", {willReadFrequently: true});
        context.drawImage(canvas, 0, 0);
        const {data} = context.getImageData(0, 0, copy.width, copy.height);"""
    page.until(pixels + """
        const seen = new Set();
        for (let i = 0; i < data.length; i += 4)
            seen.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
        return seen.size > 1;""", "the error map is blank")
    sums = pixels + "return data.reduce((sum, value) => sum + value, 0);"
    before = page.js(sums)
    gain = page.find("#point .gain input")
    gain.send_keys(Keys.ARROW_RIGHT)
    check(page.js(sums) != before, "the gain does not change the error map")
    gain.send_keys(Keys.ARROW_LEFT)


def check_keyboard(page):
    page.js("""document.querySelector('#canvas .mark[tabindex="0"]').focus()""")
    active = page.driver.switch_to.active_element
    active.send_keys(Keys.HOME)
    first = page.js("return document.activeElement.dataset.id")
    check(page.find("#tip").is_displayed(), "a mark with the focus shows no tooltip")
    page.driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    second = page.js("return document.activeElement.dataset.id")
    check(first and second and first != second, "arrow keys do not go from mark to mark")
    check(page.js("return document.querySelectorAll('#canvas .mark[tabindex=\"0\"]').length") == 1,
          "not exactly one mark can be reached by Tab")
    page.driver.switch_to.active_element.send_keys(Keys.ENTER)
    check(page.find("#canvas .mark.chosen").get_attribute("data-id") == second,
          "Enter does not choose the mark with the focus")
    page.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
    check(not page.find("#tip").is_displayed(), "Escape does not put the tooltip away")
    # The choices are radio buttons: the arrow goes to the next, which keeps the focus.
    page.js("document.querySelector('input[name=measure]:checked').focus()")
    page.driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    now = page.js("const {name, checked} = document.activeElement; return [name, checked]")
    check(now == ["measure", True], f"the focus is lost when a choice is made: {now}")
    page.driver.switch_to.active_element.send_keys(Keys.ARROW_LEFT)


def check_legend(page):
    button = page.find("#legend button[aria-pressed]")
    before = len(page.all("#canvas .mark"))
    page.js("arguments[0].click()", button)
    button = page.find("#legend button[aria-pressed='false']")
    less = len(page.all("#canvas .mark"))
    check(less < before, "the legend does not take a kernel out of the plot")
    page.js("arguments[0].click()", button)
    check(len(page.all("#canvas .mark")) == before, "the legend does not bring a kernel back")


def check_scenery(page):
    """A thumbnail for each scene that decodes, or none at all in a page without pictures."""
    broken = page.js("return [...document.images].filter((i) => i.complete && !i.naturalWidth)"
                     ".map((i) => i.alt)")
    check(not broken, f"pictures do not decode: {broken}")


def check_words(page):
    shown = page.js("return document.body.innerText").split()
    for word in ("null", "undefined", "NaN", "[object"):
        check(word not in shown, f"the page shows no '{word}'")


def check_width(page, width):
    wide = page.js("""
        const page = document.documentElement, width = arguments[0];
        if (page.scrollWidth <= width) return null;
        const out = [...document.body.querySelectorAll("*")].filter((node) =>
            node.getBoundingClientRect().right > width + 0.5 &&
            !node.closest(".box, .scenes, .skip"));
        return page.scrollWidth + " for " + out.slice(0, 4).map((node) =>
            node.tagName + "." + node.getAttribute("class")).join(", ");""", width)
    check(wide is None, f"{width} pixels wide, the page scrolls sideways: {wide}")


def brightness(page):
    return page.js("""
        const [r, g, b] = getComputedStyle(document.body).backgroundColor.match(/[\\d.]+/g);
        return (Number(r) + Number(g) + Number(b)) / 3;""")


def check_contrast(page, theme):
    """Text against its ground: 4.5 as WCAG wants it for small letters."""
    low = page.js("""
        const light = (text) => {
            const [r, g, b] = text.match(/[\\d.]+/g).slice(0, 3).map((v) => {
                v /= 255;
                return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
            });
            return 0.2126 * r + 0.7152 * g + 0.0722 * b;
        };
        const ground = (node) => {
            for (; node; node = node.parentElement) {
                const colour = getComputedStyle(node).backgroundColor;
                if (!/, 0\\)$|transparent/.test(colour)) return colour;
            }
            return "rgb(255, 255, 255)";
        };
        const low = [];
        for (const selector of ["h1", "h1 small", ".lead", ".facts dt", "nav a", ".options span",
                                "legend", ".notes p", ".pairs dt", ".sheet td", ".sheet .link",
                                ".soft", ".better", ".worse", ".badge", "#theme"]) {
            const node = document.querySelector(selector);
            if (!node) continue;
            const a = light(getComputedStyle(node).color), b = light(ground(node));
            const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
            if (ratio < 4.5) low.push(`${selector}: ${ratio.toFixed(2)}`);
        }
        return low;""")
    check(not low, f"{theme}: too little contrast: {low}")


def check_themes(page):
    page.media(prefers_color_scheme="dark")
    dark = brightness(page)
    check_contrast(page, "dark")
    page.shoot("dark.png", 1200)
    page.media(prefers_color_scheme="light")
    light = brightness(page)
    check_contrast(page, "light")
    page.shoot("light.png", 1200)
    check(light > 200 and dark < 60, f"backgrounds of brightness {light} and {dark}, light and dark")
    # The button: light, dark, and back to the system's.
    seen = []
    for _ in range(3):
        page.js("document.querySelector('#theme').click()")
        seen.append(brightness(page) > 128)
    check(seen == [True, False, True], f"the button for colours gives {seen}")


def check_print(page):
    page.media("print", prefers_color_scheme="dark")
    check(brightness(page) > 250, "the ground is not white on paper")
    left = page.js("""return [...document.querySelectorAll(
        "nav, #theme, .choices, #scenes, .gain, .legend .quiet, .pictures select, input[type=range]")]
        .filter((node) => node.getClientRects().length).map((node) => node.id || node.className);""")
    check(not left, f"controls are printed: {left}")
    cut = page.js("""return [...document.querySelectorAll(".box")].filter((box) =>
        getComputedStyle(box).maxHeight !== "none").length;""")
    check(cut == 0, f"{cut} tables are cut on paper")
    page.shoot("print.png", 1000)
    page.media()
    pdf = page.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": False})
    content = base64.b64decode(pdf["data"])
    check(content.startswith(b"%PDF") and len(content) > 20000, "the page does not print")
    if page.folder is not None:
        (page.folder / "print.pdf").write_bytes(content)


def check_motion(page):
    for wish, behaviour in (("no-preference", "smooth"), ("reduce", "auto")):
        page.media(prefers_reduced_motion=wish)
        now = page.js("return getComputedStyle(document.documentElement).scrollBehavior")
        check(now == behaviour, f"prefers-reduced-motion: {wish}: scrolling is {now}")


def check_link(page):
    """The address keeps the choice."""
    chosen = page.find("#canvas .mark.chosen").get_attribute("data-id")
    title = page.find("#plot-title").text
    page.driver.refresh()
    page.until("return document.readyState === 'complete'", "the page does not load again")
    check(page.find("#canvas .mark.chosen").get_attribute("data-id") == chosen
          and page.find("#plot-title").text == title, "the address does not keep the choice")


def check_page(page):
    page.size(1200)
    page.media(prefers_color_scheme="light")
    page.open()
    check(page.all("#canvas svg .mark"), "the page shows no plot")
    report = json.loads(page.js("return document.querySelector('#report').textContent"))
    pictures = page.js("return JSON.parse(document.querySelector('#pictures-shaded').textContent)")
    check_themes(page)
    check_scenery(page)
    check_words(page)
    check_plots(page, report)
    check_plans(page, report, pictures)
    # The cell of the most results is the one for the rest.
    fullest = max(report["cells"], key=lambda cell: len(cell["results"]))
    page.choose("scene", fullest["scene"])
    check_measures(page)
    check_sorting(page)
    check_point(page, report)
    check_keyboard(page)
    if pictures:
        check_slider(page)
        check_error_map(page)
    else:
        check("no picture" in page.find("#point .pictures").text,
              "a page without pictures does not say so")
    check_legend(page)
    check_motion(page)
    # As it opens, for the pictures.
    page.open()
    for width in (1200, 800, 360):
        page.size(width, mobile=width < 500)
        check_width(page, width)
    page.shoot("phone.png", 360, mobile=True)
    page.size(1200)
    check_print(page)
    check_link(page)
    page.log()
    elsewhere = [address for address in page.requests if not address.startswith(("file:", "data:"))]
    check(not elsewhere, f"the page asks for {elsewhere[:3]}")
    files = {address.split("#")[0] for address in page.requests if address.startswith("file:")}
    check(files <= {page.address}, f"the page asks for other files: {sorted(files)[:3]}")
    check(not page.complaints, f"the browser complains: {page.complaints[:3]}")
    marks = sum(len(cell["results"]) for cell in report["cells"])
    print(f"{len(report['cells'])} plots, {marks} results: all checks hold")


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    path = pathlib.Path(sys.argv[1])
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) == 3 else None
    page = None
    try:
        check(path.is_file(), f"{path}: no such file")
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        page = Page(path, folder)
        check_page(page)
    except Wrong as wrong:
        print(f"report_page.py: {wrong}", file=sys.stderr)
        if page is not None:
            page.log()
            for text in page.complaints[:5]:
                print(f"  browser: {text}", file=sys.stderr)
        return 1
    except (WebDriverException, OSError) as error:
        print(f"report_page.py: {type(error).__name__}: {str(error).splitlines()[0]}",
              file=sys.stderr)
        return 1
    finally:
        if page is not None:
            page.driver.quit()
    return 0


if __name__ == "__main__":
    sys.exit(main())
