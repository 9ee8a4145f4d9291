"""The views of a recording, each in a file of its own: what it gathers and sends, how it looks, and where it stands.

To add one, write a subclass of `base.View` and put it into `VIEWS`.
"""

from typing import Final

from scla_mj.telemetry.views.arena import Arena
from scla_mj.telemetry.views.base import View
from scla_mj.telemetry.views.explanation import Explanation
from scla_mj.telemetry.views.hits import Hits
from scla_mj.telemetry.views.lanes import Lanes
from scla_mj.telemetry.views.learned import Learned
from scla_mj.telemetry.views.maps import Maps
from scla_mj.telemetry.views.potentials import Potentials
from scla_mj.telemetry.views.raster import Raster
from scla_mj.telemetry.views.series import Series
from scla_mj.telemetry.views.text import Text
from scla_mj.telemetry.views.votes import Votes
from scla_mj.telemetry.views.weights import WeightPicture

VIEWS: Final[tuple[type[View], ...]] = (
    Raster, Potentials, Series, Arena, Votes, Lanes, Explanation, Learned, WeightPicture, Maps, Text, Hits,
)  # fmt: skip
"""In the order in which they send: spikes first and hits last, so that a file cut short counts no decision whose spikes
are missing."""
