"""The dashboard that a recording opens as: which places it has. What stands there, each view says itself."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import rerun.blueprint as rrb

from scla_mj.telemetry import names
from scla_mj.telemetry.views.base import Panel, Place


def build_dashboard(panels: Iterable[Panel]) -> rrb.Blueprint:
    """Return the whole dashboard: two panels above each other on the left, two rows and a row of tabs on the right."""
    ranked = sorted(panels, key=lambda panel: panel.rank)

    def at(place: Place) -> tuple[list[Any], list[float]]:
        here = [panel for panel in ranked if panel.place is place]
        return [panel.content for panel in here], [panel.share for panel in here]

    left, left_shares = at(Place.LEFT)
    top, top_shares = at(Place.TOP)
    middle, middle_shares = at(Place.MIDDLE)
    tabs, _ = at(Place.TABS)
    rows = [
        (4, rrb.Horizontal(*top, column_shares=top_shares)),
        (3, rrb.Horizontal(*middle, column_shares=middle_shares)),  # a brain without neurons has nothing there
        (4, rrb.Tabs(*tabs, active_tab=0)),
    ]
    shown = [(share, row) for share, row in rows if row.contents]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(*left, row_shares=left_shares),
            rrb.Vertical(*(row for _, row in shown), row_shares=[share for share, _ in shown]),
            column_shares=[1, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline=names.SIM_TIME, play_state="playing"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )
