"""Make the pictures of the first page of the site and of the gallery that no other script makes; by hand, some minutes.

    python docs/make_home.py            # needs chromium and chromedriver for the report

The film is that of ``prensa plot --film``, saved once more as WebP, which takes a third of the room of a GIF.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

DOCS = Path(__file__).parent
PICTURES = DOCS / "guide" / "pictures"
EXAMPLES = DOCS.parent / "examples"
GALLERY = DOCS / "gallery" / "pictures"
SHOWN = ("heading", "combined_extrusion", "ball_indentation", "square_billet")
SCREENS = {"report_desktop": (1280, 860), "report_phone": (390, 860)}


def prensa(*words: str | Path) -> None:
    """One command of prensa."""
    subprocess.run([sys.executable, "-m", "prensa", *map(str, words)], check=True)


def film(folder: Path) -> None:
    """A gear blank forged in a closed die."""
    changes = ("--set", "output.fields=7", "--set", "output.mirror=bottom")
    prensa("run", EXAMPLES / "closed_die.yaml", "--out", folder / "forged", *changes, "--quiet")
    shown = ("--box=-30,30,-21,21", "--range", "0,2.5", "--size", "5.4x4.9", "--dpi", "100", "--no-mesh")
    prensa("plot", folder / "forged", "--film", "--field", "plastic_strain", *shown, "--out", folder / "film.gif", "--quiet")
    with Image.open(folder / "film.gif") as gif:
        pictures = [_frame(gif, k) for k in range(gif.n_frames)]
    lasts = [90] * (len(pictures) - 1) + [1500]  # ms; the last one is looked at
    target = PICTURES / "forging.webp"
    pictures[0].save(target, save_all=True, append_images=pictures[1:], duration=lasts, loop=0, quality=60, method=6)
    print(f"{target.name}: {len(pictures)} pictures, {target.stat().st_size // 1024} kB")


def _frame(gif: Image.Image, number: int) -> Image.Image:
    gif.seek(number)
    return gif.convert("RGB")


@contextmanager
def browser() -> Iterator[webdriver.Chrome]:
    """Chromium without a window."""
    options = webdriver.ChromeOptions()
    for option in ("--headless=new", "--no-sandbox", "--hide-scrollbars", "--force-device-scale-factor=1"):
        options.add_argument(option)
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    try:
        yield driver
    finally:
        driver.quit()


def report(folder: Path) -> None:
    """The report of a billet on a crank press, on a desktop and on a phone."""
    prensa("run", EXAMPLES / "crank_press.yaml", "--out", folder / "pressed", "--quiet")
    with browser() as driver:
        for name, (width, height) in SCREENS.items():
            emulated = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": name.endswith("phone")}
            driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", emulated)
            driver.get((folder / "pressed" / "report.html").as_uri())
            time.sleep(3)  # the page draws its pictures
            driver.save_screenshot(str(folder / f"{name}.png"))
            keep(folder / f"{name}.png", PICTURES)
    keep(folder / "pressed" / "pictures" / "press_ram.png", PICTURES)


def examples(folder: Path) -> None:
    """Plastic strain at the end of examples that the gallery shows."""
    for name in SHOWN:
        prensa("run", EXAMPLES / f"{name}.yaml", "--out", folder / name, "--quiet")
        prensa("plot", folder / name, "--field", "plastic_strain", "--out", folder / f"{name}.png", "--quiet")
        keep(folder / f"{name}.png", GALLERY)


def keep(picture: Path, where: Path) -> None:
    """A picture in few colours."""
    with Image.open(picture) as made:
        made.convert("RGB").quantize(200).save(where / picture.name, optimize=True)
    print(f"{picture.name}: {(where / picture.name).stat().st_size // 1024} kB")


def main() -> None:
    """Run, film, photograph."""
    with tempfile.TemporaryDirectory() as name:
        for made in (film, report, examples):
            made(Path(name))


if __name__ == "__main__":
    main()
