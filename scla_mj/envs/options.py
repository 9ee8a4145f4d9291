"""Keyword arguments of an environment as a checked configuration: the names and ranges are those of `RunConfig`."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any, Final

from scla_mj.checked import CheckedConfig, check
from scla_mj.config import RunConfig
from scla_mj.disturbances import with_sets
from scla_mj.errors import SclaError
from scla_mj.floor import with_new_files
from scla_mj.validation import shown

_SECTIONS: Final = ("grid", "task", "clock", "controller", "disturbance")
_PLAIN: Final = ("protocol", "robot", "localisation", "epochs", "decisions")


def checked_options(
    config: RunConfig | None, options: dict[str, Any], *, without: Collection[str] = ()
) -> CheckedConfig:
    """Return the configuration of a task: `config`, changed by settings that are named without their section.

    Args:
        config: where to start from, None for the defaults; what it says of brains is not read.
        options: settings by name, such as `action_noise=0.1`; `disturb` takes the names of sets.
        without: the names of settings that the environment has no use for.

    Raises:
        SclaError: there is no such setting, or its value cannot be taken.
    """
    whole = RunConfig() if config is None else config
    if not isinstance(whole, RunConfig):
        raise SclaError(
            f"config is {shown(config)}: it must be a RunConfig, such as RunConfig(protocol='sensed-start')"
        )
    whole = with_new_files(whole, options)
    places = {name: section for section in _SECTIONS for name in _names(getattr(whole, section))}
    known = [name for name in (*_PLAIN, *places, "disturb") if name not in without]
    for name in options:
        if name not in known:
            raise SclaError(f"{name} is no setting of this environment: choose from {', '.join(known)}")
    changed = {name: dict[str, Any]() for name in _SECTIONS}
    for name, value in options.items():
        if name in places:
            changed[places[name]][name] = value
    sections = {name: dataclasses.replace(getattr(whole, name), **values) for name, values in changed.items()}
    sections["disturbance"] = with_sets(sections["disturbance"], options.get("disturb", []))
    plain = {name: options[name] for name in _PLAIN if name in options}
    return check(dataclasses.replace(whole, brain="random", brain_settings={}, **plain, **sections))


def _names(section: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(section)]
