"""Page of a campaign report in a real browser."""

import json
import subprocess
from datetime import UTC, datetime

from bench.campaign_report import gather_campaign, write_campaign_report
from bench.commands.campaign.catalogue import open_store
from tests.support.campaign_reports import make_result, prompt_step, run_step, store_campaign
from tests.support.page_in_browser import CHROMIUM, FOLDER, NODE, browser_test


@browser_test
def test_the_page_has_no_finding_of_axe_core_and_no_sideways_scroll_in_either_colour_scheme(tmp_path):
    run = run_step("MR-0042-with-a-long-serial-number")
    steps = [run, run, run, prompt_step(), run, run, {"rest": {"seconds": 60}}]
    results = [
        make_result(value, effects=("seal_friction",)) for value in (2600.0, 2604.0, 2602.0, 2640.0, 2644.0)
    ]
    path = tmp_path / "report.html"
    with open_store(tmp_path / "data", is_created=True) as store:
        stored = store_campaign(store, steps, results, {6: ("skipped", "deleted by a person")}, "stopped")
        report = gather_campaign(store, stored)
    write_campaign_report(report, "html", path, "mrbench campaign report", datetime(2026, 5, 4, tzinfo=UTC))
    command = [str(NODE), str(FOLDER / "audit_file.mjs"), str(path), str(CHROMIUM)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout) == []
