"""Screenshots of the page for the documentation.

``python docs/take_screenshots.py`` starts a simulated rig, agent, service and worker on loopback. It imports a
recording, records a campaign over the wires, waits for fits and diagnoses, and writes the pictures of the page to
`docs/images`. It is run by hand after a change of the page, on a quiet machine: a busy one delays the setpoints of
the rig.

Needed are chromium, Node and ``npm ci --prefix tests/system/javascript``, as for the tests of the page.
With ``--data FOLDER`` the recordings and results stay in that folder, and a second call with it only takes the
pictures. ``--only NAME`` calls one function of `take_screenshots.mjs`, and may be repeated.
"""

import argparse
import json
import secrets
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2
from PIL import Image

from bench.client import Bench, Campaign
from bench.demo import DemoFolder, start_processes
from bench.processes import MRBENCH_COMMAND

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
SCRIPT = ROOT / "tests" / "system" / "javascript" / "take_screenshots.mjs"
SEED = 1
"""Seed of the hidden effect of the rig's damper."""
DEADLINE = 3600.0
"""Longest time [s] for all recordings or all results."""
COLOURS = 256
"""Colours of a picture: a palette makes its file smaller, and a page has few colours."""
DATA_KEPT = "prepared.json"
"""File of a data folder whose recordings and results are complete."""

DAMPER = {
    "damper_kind": "laboratory damper",
    "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.02, "force_n": 1500.0},
}
SPECIMENS = {
    "MR-0042": "New, from the series of November",
    "MR-0043": "New, from the series of November",
    "MR-0107": "Gas behind the piston, recorded elsewhere",
}
SIGNED_IN = "m.curie"
"""Person who is signed in on the pictures."""
PEOPLE = {
    "m.curie": ("Marie Curie", "administrator"),
    "r.franklin": ("Rosalind Franklin", "engineer"),
    "l.meitner": ("Lise Meitner", "technician"),
    "c.gauss": ("Carl Friedrich Gauss", "viewer"),
}
CAMPAIGN = {
    "name": "acceptance-of-series",
    "seed": 3,
    "steps": {
        "matrix": {
            "specimens": ["MR-0042", "MR-0043"],
            "methods": ["quick", "validation"],
            "repeats": 2,
            "order": "listed",
            "before_specimen": [{"prompt": {"text": "Mount the next specimen, tighten the clevis", "note": True}}],
        }
    },
    "stop_on": [{"drift": {"parameter": "k0", "percent": 10}}, {"trip": True}],
    "on_failure": "retry",
    "retries": 2,
}


def main() -> None:
    """Take the pictures that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder that keeps recordings and results")
    parser.add_argument("--only", action="append", metavar="NAME", help="name of a picture; all by default")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.data or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        demo = DemoFolder(folder, "quick", None, SEED)
        # A pseudo terminal can stop for a third of a second while chromium uses the same cores; a socket does not.
        rig = ("--draw", str(SEED), "--truth", str(demo.truth), "--load-cell", "tcp")
        with start_processes(demo, rig) as page:
            take_pictures(Laboratory(page, folder), folder, options.only or [])


def take_pictures(laboratory: "Laboratory", folder: Path, only: list[str]) -> None:
    """Prepare what the pictures show if the folder does not have it, and take them."""
    kept, pictures = folder / DATA_KEPT, folder / "pictures"
    shutil.rmtree(pictures, ignore_errors=True)
    pictures.mkdir()
    if not kept.exists():
        laboratory.set_up()
        laboratory.import_recording()
        campaign = laboratory.run_campaign(lambda found: photograph(laboratory, pictures, found, ["question"]))
        laboratory.wait_for_results()
        kept.write_text(json.dumps(campaign), encoding="utf-8")
    photograph(laboratory, pictures, json.loads(kept.read_text("utf-8")), only)
    for picture in sorted(pictures.glob("*.png")):
        compress(picture, IMAGES / picture.name)


def photograph(laboratory: "Laboratory", pictures: Path, campaign: dict[str, str], only: list[str]) -> None:
    """Take pictures of the page in chromium; without names, all that need no waiting campaign."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome") or "chromium"
    shown = json.dumps(campaign | laboratory.make_sign_in())
    subprocess.run(["node", str(SCRIPT), laboratory.page, str(pictures), chromium, shown, *only], check=True)


def compress(picture: Path, to: Path) -> None:
    """Write a picture with a palette; screenshots of a page have few colours."""
    with Image.open(picture) as image:
        image.convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(to)


class Laboratory:
    """Bench of the pictures: what is recorded and computed before they are taken.

    Args:
        page: address of the page, with the token.
        folder: folder for the files that are imported.
    """

    def __init__(self, page: str, folder: Path) -> None:
        self.page, self._folder, self.bench = page, folder, Bench(page)
        base, _, token = page.partition("#token=")
        self._http = httpx2.Client(
            base_url=f"{base}api/v1", headers={"Authorization": f"Bearer {token}"}, timeout=300.0
        )

    def set_up(self) -> None:
        """Wait for the worker, and register specimens and people."""
        self._wait_until(lambda: self._get("/health")["worker"] == "ok")
        for serial, description in SPECIMENS.items():
            self._post("/specimens", {**DAMPER, "serial": serial, "description": description})
        for name, (full_name, role) in PEOPLE.items():
            password = secrets.token_urlsafe(16)
            self._post("/users", {"name": name, "full_name": full_name, "role": role, "password": password})

    def make_sign_in(self) -> dict[str, str]:
        """Return name and new password of the person on the pictures."""
        password = secrets.token_urlsafe(16)
        self._http.patch(f"/users/{SIGNED_IN}", json={"password": password}).raise_for_status()
        return {"user": SIGNED_IN, "password": password}

    def import_recording(self) -> None:
        """Record a damper with gas on the simulated plant, and import the log."""
        log = self._folder / "gas.mcap"
        words = ("run", "quick", "--scenario", "gas_spring", "--specimen", "MR-0107", "--out", str(log))
        subprocess.run([*MRBENCH_COMMAND, *words], check=True)
        with log.open("rb") as file:
            self._http.post("/logs", files={"file": (log.name, file)}).raise_for_status()

    def run_campaign(self, photograph_question: Callable[[dict[str, str]], None]) -> dict[str, str]:
        """Run the campaign to its end; at the question of the second specimen, pictures are taken.

        Returns:
            Id of the campaign, as `campaign`.
        """
        campaign = self.bench.start_campaign(CAMPAIGN, "L. Meitner")
        found = {"campaign": campaign.id}
        self._answer(campaign)
        campaign.wait(DEADLINE)
        self.wait_for_results()
        photograph_question(found)
        self._answer(campaign)
        campaign.wait(DEADLINE)
        return found

    def wait_for_results(self) -> None:
        """Wait until no job is queued or in progress."""
        self._wait_until(lambda: not self._get("/jobs?state=queued&state=running")["items"])

    def _answer(self, campaign: Campaign) -> None:
        self._wait_until(lambda: campaign.get_state()["question"])
        campaign.answer("torque 12 N m", "L. Meitner")

    def _wait_until(self, condition: Callable[[], object]) -> None:
        end = time.monotonic() + DEADLINE
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(
                    f"the bench was not ready within {DEADLINE:g} s; see its log in the data folder"
                )
            time.sleep(1.0)

    def _get(self, path: str) -> Any:
        return self._http.get(path).raise_for_status().json()

    def _post(self, path: str, content: dict[str, Any]) -> Any:
        return self._http.post(path, json=content).raise_for_status().json()


if __name__ == "__main__":
    main()
