"""Resolved files to what they mean, or to what is wrong with them: one module for each kind of file."""

from socialai_dsl.checking.choices import of_other_values
from socialai_dsl.checking.experiments import LoadedExperiment, check_experiment
from socialai_dsl.checking.ignored import sift
from socialai_dsl.checking.libraries import check_library, check_npc
from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite, Start
from socialai_dsl.checking.repetitions import said_once
from socialai_dsl.checking.scenarios import check_scenario, naming_the_patch
from socialai_dsl.checking.suites import check_suite
from socialai_dsl.checking.swallowed import swallowed

__all__ = [
    "Loaded",
    "LoadedExperiment",
    "LoadedScenario",
    "LoadedSuite",
    "Start",
    "check_experiment",
    "check_library",
    "check_npc",
    "check_scenario",
    "check_suite",
    "naming_the_patch",
    "of_other_values",
    "said_once",
    "sift",
    "swallowed",
]
