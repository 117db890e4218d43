"""The interactive report in a real browser: everything is clicked, nothing complains, what is drawn is looked at."""

from __future__ import annotations

import io
import shutil
import time

import numpy as np
import pytest

import prensa as pr
from prensa.model.problem import Output
from prensa.output.report import stored_run
from prensa.output.run import run
from prensa.output.scene import as_json, scene

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
DRIVER = shutil.which("chromedriver")
needs_browser = pytest.mark.skipif(
    BROWSER is None or DRIVER is None, reason="no Chromium with chromedriver on this machine: install both to test the page"
)


def case() -> pr.Case:
    """Half of a block that a punch presses and leaves, and that another one has never touched."""
    problem = pr.Problem(
        "page", bodies={"block": pr.Body(pr.Rectangle((4, 3), (8, 6)), pr.J2(70e3, 0.3, pr.Linear(100, 500)))},
        tools={"punch": pr.Stamp(width=3, fillet=0.4, touching="block.top"), "wall": pr.Plane(normal=(-1, 0), at=(9, 0))},
        contacts=(pr.Contact(("block.top",), "punch"), pr.Contact(("block.right",), "wall")), friction=pr.Coulomb(0.1),
        fixed={"block.bottom": "y", "block.left": "x"},
        steps=(pr.Step("press", move={"punch": pr.Motion(y=-0.2)}, increments=6),
               pr.Step("leave", move={"punch": pr.Motion(y=0.2)}, increments=3)),
    )  # fmt: skip
    return pr.Case(problem, output=Output(pictures=True, mirror=("left",)))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return run(case(), tmp_path_factory.mktemp("page"), quiet=True, source="page.yaml")


@pytest.fixture(scope="module")
def browser():
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--window-size=1200,900"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    made = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield made
    made.quit()


@pytest.fixture
def page(browser, done):
    return opened(browser, done.directory / "report.html")


def opened(browser, path, width=1200, height=900, mobile=False):
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(path.as_uri())
    wait(browser, "return !!(window.prensa && window.prensa.ready)")
    return browser


def wait(browser, script: str, *arguments) -> None:
    """Until a script answers true; two minutes at most, which only a page that hangs takes."""
    end = time.monotonic() + 120
    while not browser.execute_script(script, *arguments):
        assert time.monotonic() < end, (script, complaints(browser))
        time.sleep(0.05)


def painted(browser) -> None:
    """Wait until what was asked for is on the screen."""
    browser.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => "
                                 "setTimeout(() => requestAnimationFrame(() => setTimeout(done, 30)), 30)));")  # fmt: skip


def complaints(browser) -> list[str]:
    return [entry["message"] for entry in browser.get_log("browser") if entry["level"] in ("WARNING", "SEVERE")]


def pixels(browser, what: str) -> np.ndarray:
    from PIL import Image

    element = browser.find_element("id", what)
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
    painted(browser)
    return np.asarray(Image.open(io.BytesIO(element.screenshot_as_png)).convert("RGB")).astype(int)


def choose(browser, what: str, value: str) -> None:
    browser.execute_script("const e = document.getElementById(arguments[0]); if (e.type === 'checkbox') e.checked = "
                           "arguments[1] === 'on'; else e.value = arguments[1]; e.dispatchEvent(new Event('input'));",
                           what, value)  # fmt: skip
    painted(browser)


def colourful(image: np.ndarray) -> float:
    """Share of the pixels that are neither white nor grey."""
    return float((np.ptp(image, axis=2) > 30).mean())


# ------------------------------------------------------------------------------------------------------ without browser
def test_frames_are_the_increments_with_fields_and_thinned_ones_keep_first_last_and_peak(done):
    """All increments are shown; where they would be too many, the first, the last and that of the largest force stay."""
    stored = stored_run(done.directory)
    made, data = scene(stored)
    assert made["frames"] == list(range(len(stored))) and made["shown"] == made["drawn"] == [len(stored)] * 2
    fewer, text = scene(stored, 0.8 * (len(data) + len(as_json(made))))
    peak = max(stored, key=lambda i: abs(i.force("punch").y)).number
    assert {0, peak - 1, len(stored) - 1} <= set(fewer["frames"]) and fewer["shown"] == [len(fewer["frames"]), len(stored)]
    assert len(fewer["frames"]) < len(stored)
    assert len(text) + len(as_json(fewer)) <= 0.8 * (len(data) + len(as_json(made)))


def test_curves_of_very_many_increments_have_fewer_points(done, monkeypatch):
    """The increments that are shown stay among them, and the slider's label counts all."""
    from prensa.output import scene as module

    monkeypatch.setattr(module, "CURVES_SIZE", 1)
    stored = stored_run(done.directory)
    made, _ = scene(stored, 1)
    assert made["drawn"] == [1, len(stored)]
    assert made["history"]["increment"] == [len(stored)] and made["frames"] == [0]


def test_only_contacts_that_touch_are_shown(done):
    """The wall that nothing reaches has no empty plot, neither on the page nor among the pictures."""
    assert [c["name"] for c in scene(stored_run(done.directory))[0]["contacts"]] == ["block.top-punch"]
    assert sorted(p.name for p in (done.directory / "pictures").glob("pressure*")) == ["pressure_block.top-punch.png"]


def made_without_solver(directory, sizes):
    """The page of a run whose increments have meshes of so many elements along and across."""
    import json
    from contextlib import closing

    import synthetic

    from prensa.output import history, report, vtk
    from prensa.output.checkpoint import case_text, text_hash

    case, number = synthetic.case(n=sizes[0]), len(sizes)
    with closing(history.History(directory, case.problem)) as table:
        fields = vtk.Fields(directory)
        for k, n in enumerate(sizes, 1):
            made = synthetic.increment(k, number, n)
            table.append(made)
            fields.append(made)
            history.write_contact(directory, synthetic.CONTACT, k, made.contacts[synthetic.CONTACT])
    summary = {
        "name": "made", "status": "completed", "reason": "", "version": "0", "source": "", "finished": "",
        "input_hash": text_hash(case_text(case)), "tools": {"cylinder": {"at": [0, 80], "direction": [0, -1]}},
        "bodies": {}, "warnings": [], "timings": {},
        "totals": {"increments": number, "iterations": 18, "cutbacks": 0, "time": 1.0, "end": 1.0, "wall_seconds": 1.0},
        "convergence": {"mean_iterations": 6.0, "max_iterations": 6, "max_residual": 1e-10, "tolerance": 1e-9},
        "case": case_text(case),
    }  # fmt: skip
    (directory / "summary.json").write_text(json.dumps(summary))
    return report.write_report(directory)


def remeshed(directory):
    """The page of a run whose mesh changes between its second and third increment."""
    return made_without_solver(directory, [(8, 4), (8, 4), (12, 6)])


def test_a_mesh_that_changes_starts_a_group_of_frames(tmp_path):
    """Frames of one mesh share its cells; those of the next have their own, bodies and contact surfaces alike."""
    remeshed(tmp_path)
    made, _ = scene(stored_run(tmp_path))
    assert [(g["first"], g["last"], g["bodies"][0]["elements"]) for g in made["groups"]] == [(0, 2, 32), (2, 3, 72)]
    assert [(g["first"], g["last"]) for g in made["contacts"][0]["groups"]] == [(0, 2), (2, 3)]


# ----------------------------------------------------------------------------------------------------------- in a browser
@needs_browser
def test_the_slider_goes_through_meshes_that_change(browser, tmp_path):
    """Picture and contact follow into the other mesh and back, without a complaint."""
    page = opened(browser, remeshed(tmp_path))
    counts = [page.execute_script("prensa.go(arguments[0]); return prensa.bodies()[0].x.length", k) for k in (0, 2, 1)]
    assert counts == [45, 91, 45]
    assert colourful(pixels(page, "picture")) > 0.1 and colourful(pixels(page, "tractions")) > 0.002
    assert complaints(page) == []


@needs_browser
def test_what_the_page_unpacks_is_what_the_run_wrote(page, done):
    """Displacements and fields of every frame come back within half a step of their quantisation."""
    stored = stored_run(done.directory)
    described = page.execute_script("return prensa.scene.fields.map(f => [f.key, f.low, f.high])")
    for k in (0, 4, len(stored) - 1):
        body = stored[k].bodies["block"]
        u = page.execute_script("prensa.go(arguments[0]); return prensa.bodies().map(b => [[...b.x], [...b.y]])[0]", k)
        assert np.abs(np.transpose(u) - body.x).max() < 1e-4 * np.ptp(body.displacement)
        for key, low, high in described:
            if key in ("mises", "plastic_strain", "stress.xx", "stress.xy"):
                choose(page, "field", key)
                values = page.execute_script("return [...prensa.bodies()[0].value]")
                from prensa.output.plot import field_values

                assert np.abs(np.array(values) - field_values(body, key)).max() <= 0.51 * (high - low) / 4095
    assert complaints(page) == []


@needs_browser
def test_the_page_opens_at_the_largest_force_and_shows_a_body_and_curves(page, done):
    """No empty picture: the shape is coloured, every plot has curves, nothing complains."""
    stored = stored_run(done.directory)
    peak = max(range(len(stored)), key=lambda k: abs(stored[k].force("punch").y))
    assert page.execute_script("return prensa.state.frame") == peak
    assert colourful(pixels(page, "picture")) > 0.1
    assert page.execute_script("return performance.getEntriesByType('resource').map(e => e.name)") == []  # nothing is fetched
    for what in ("force", "tractions", "slips", "energies", "cost"):
        assert colourful(pixels(page, what)) > 0.002, what
    assert complaints(page) == []


@needs_browser
def test_the_slider_moves_everything(page):
    """Slider, buttons and keys change picture, label and contact; play runs to the end by itself."""
    from selenium.webdriver.common.keys import Keys

    page.find_element("id", "first").click()
    before = pixels(page, "picture"), pixels(page, "tractions")
    choose(page, "slider", "5")
    assert "increment 6 of" in page.find_element("id", "now").text and "press" in page.find_element("id", "now").text
    assert all((a != b).any() for a, b in zip(before, (pixels(page, "picture"), pixels(page, "tractions"))))
    page.find_element("tag name", "body").send_keys(Keys.ARROW_LEFT)
    assert page.execute_script("return prensa.state.frame") == 4
    page.find_element("id", "on").click()
    page.find_element("id", "back").click()
    assert page.execute_script("return prensa.state.frame") == 4
    page.find_element("id", "play").click()
    wait(page, "return !prensa.state.playing && prensa.state.frame === prensa.scene.frames.length - 1")
    page.find_element("id", "peak").click()
    assert "step" in page.page_source and complaints(page) == []


@pytest.mark.slow
@needs_browser
def test_fields_ranges_mesh_and_mirror_change_the_picture(page):
    """Every control of the picture does something to it, and every field can be shown."""
    keys = page.execute_script("return prensa.scene.fields.map(f => f.key)")
    assert {"mises", "plastic_strain", "displacement", "stress.xx"} <= set(keys)
    seen = [pixels(page, "picture")]
    for control, value in [*(("field", k) for k in keys[1:]), ("range", "now"), ("mesh", ""), ("mirror", ""),
                           ("mirror-bottom", ""), ("tools", ""), ("initial", ""), ("scale", "3")]:  # fmt: skip
        choose(page, control, value)
        seen.append(pixels(page, "picture"))
        assert (seen[-1] != seen[-2]).any(), control
    assert complaints(page) == []


@needs_browser
def test_clicks_on_plots_choose_a_moment_and_a_point(page):
    """A click on the force curve moves the slider, a click on the body opens the history of that point."""
    from selenium.webdriver.common.action_chains import ActionChains

    page.find_element("id", "last").click()
    force = page.find_element("id", "force")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", force)
    painted(page)
    ActionChains(page).move_to_element_with_offset(force, int(-0.2 * force.size["width"]), -20).click().perform()
    painted(page)
    assert page.execute_script("return prensa.state.frame !== prensa.scene.frames.length - 1")
    picture = page.find_element("id", "picture")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", picture)
    ActionChains(page).move_to_element(picture).click().perform()
    wait(page, "return !document.getElementById('probe-box').hidden")
    assert "Node " in page.find_element("id", "probe-text").text and colourful(pixels(page, "probe")) > 0.002
    assert complaints(page) == []


@pytest.mark.slow
@needs_browser
def test_a_large_run_is_painted_once_a_step(browser, tmp_path):
    """10 000 elements and 50 increments: 12 MB at most, and each facet is filled once when the slider moves.

    Seconds are measured by benchmarks/page.py: those of a test depend on who else is at work.
    """
    path = made_without_solver(tmp_path, [(100, 100)] * 50)
    assert path.stat().st_size < 12e6
    page = opened(browser, path)
    assert page.execute_script("return prensa.scene.frames.length") == 50
    page.execute_script("""
        window.fills = 0;
        const fill = CanvasRenderingContext2D.prototype.fill;
        CanvasRenderingContext2D.prototype.fill = function (...a) { window.fills++; return fill.apply(this, a); };""")
    for frame in (3, 20, 49):
        page.execute_script("window.fills = 0")
        choose(page, "slider", str(frame))
        assert page.execute_script("return prensa.state.frame") == frame
        assert 10_000 <= page.execute_script("return window.fills") < 11_000
    assert colourful(pixels(page, "picture")) > 0.1 and complaints(page) == []


@needs_browser
def test_a_phone_can_read_it(browser, done):
    """At 360 pixels nothing is wider than the screen, and no letter is smaller than 10 pixels."""
    page = opened(browser, done.directory / "report.html", 360, 740, mobile=True)
    assert page.execute_script("return document.documentElement.scrollWidth") <= 360
    small = page.execute_script("""
        const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
        while (walk.nextNode()) { const e = walk.currentNode.parentElement;
          if (walk.currentNode.data.trim() && !["SCRIPT", "STYLE", "NOSCRIPT"].includes(e.tagName) &&
              parseFloat(getComputedStyle(e).fontSize) < 10) found.push(e.outerHTML.slice(0, 80)); }
        return found;""")
    assert small == [] and colourful(pixels(page, "picture")) > 0.05
    letters = page.execute_script("""
        return Bokeh.documents.flatMap(d => [...d._all_models.values()]).filter(m => m.major_label_text_font_size)
          .map(m => parseFloat(m.major_label_text_font_size) * (m.major_label_text_font_size.endsWith("px") ? 1 : 0));""")
    assert letters and min(letters) >= 10
    assert page.find_element("id", "slider").size["width"] > 250  # a thumb can move it
    assert complaints(page) == []
