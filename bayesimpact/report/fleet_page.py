"""The page of a fleet: what changed, the population, and a line per campaign."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from bayesimpact.data.files import write_text
from bayesimpact.report.figures.save import save_figures
from bayesimpact.report.figures.series import Panel, series_figure
from bayesimpact.report.html import TEMPLATES, environment
from bayesimpact.report.policy import with_policy
from bayesimpact.report.write import REPORT_FILE


def write_fleet_page(content: Mapping[str, Any], panels: Sequence[Panel], out: Path) -> Path:
    """Write figures and report.html into a folder; path of the page.

    Parameters
    ----------
    content : of the template fleet.html.j2: name, headline, changes, populations, table, failed
    panels : what is drawn of every parameter
    """
    pictures = {}
    if panels:
        pictures = save_figures({"series": series_figure(panels)}, out / "figures")
    encoded = {n: base64.b64encode(data).decode("ascii") for n, data in pictures.items()}
    css = Markup((TEMPLATES / "style.css").read_text(encoding="utf-8"))
    page = environment().get_template("fleet.html.j2")
    write_text(out / REPORT_FILE, with_policy(page.render(css=css, pictures=encoded, **content)))
    return out / REPORT_FILE
