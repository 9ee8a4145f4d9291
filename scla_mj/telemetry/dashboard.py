"""The dashboard that a recording opens as: its tabs and their places. What stands there, each view says itself."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import rerun.blueprint as rrb

from scla_mj.telemetry import names
from scla_mj.telemetry.views.base import Panel, Place

_TABS: Final = {
    "Now": {Place.NOW_LEFT: 5, Place.NOW_RIGHT: 4},
    "Learning": {Place.LEARNING_TOP: 1, Place.LEARNING_MIDDLE: 1, Place.LEARNING_BOTTOM: 1},
    "Brain": {Place.BRAIN_LEFT: 3, Place.BRAIN_RIGHT: 2},
    "Log and about": {Place.LOG: 1},
}
"""Places and their parts of the room."""
_ROWS: Final = {Place.LEARNING_TOP, Place.LEARNING_MIDDLE, Place.LEARNING_BOTTOM, Place.LOG}
"""Rows below each other; the other places are columns."""

PLAYBACK_SPEED: Final = 2.0
"""A move takes a second: twice as fast is still seen."""


def build_dashboard(panels: Iterable[Panel]) -> rrb.Blueprint:
    """Return the whole dashboard, without the tabs and places that have no panel."""
    ranked = sorted(panels, key=lambda panel: panel.rank)
    tabs = [_tab(name, ranked) for name in _TABS]
    return rrb.Blueprint(
        rrb.Tabs(*(tab for tab in tabs if tab.contents), active_tab=0),
        rrb.TimePanel(state="collapsed", timeline=names.SIM_TIME, play_state="paused", playback_speed=PLAYBACK_SPEED),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _tab(name: str, panels: list[Panel]) -> Any:
    """Return the filled places of a tab: columns next to each other, or rows below each other."""
    places = _TABS[name]
    filled = {place: [panel for panel in panels if panel.place is place] for place in places}
    filled = {place: here for place, here in filled.items() if here}
    if len(filled) == 1:  # Rerun would drop a container with a single one in it, and the tab's name
        ((place, here),) = filled.items()
        return _line([panel.content for panel in here], [panel.share for panel in here], place in _ROWS, name)
    lines = [
        _line([panel.content for panel in here], [panel.share for panel in here], place in _ROWS)
        for place, here in filled.items()
    ]
    return _line(lines, [places[place] for place in filled], not _ROWS.intersection(places), name)


def _line(contents: list[Any], shares: list[float], in_row: bool, name: str | None = None) -> Any:
    if in_row:
        return rrb.Horizontal(*contents, column_shares=shares, name=name)
    return rrb.Vertical(*contents, row_shares=shares, name=name)
