"""Every column that a study writes is declared, with its meaning, and every one declared occurs."""

import numpy as np
import pytest
from bridge_report import BRIDGES, LOADS, WINDOWS, Case, rows
from colony_findings import condition_rows, difference_rows, judge_all, rows_of_seeds
from command_lines import TABLES, undeclared
from paper.baselines import Baseline
from paper.claims import CLAIMS, assess, claims_rows
from paper.table2 import summarise, summarise_behaviours, table2
from synthetic_colony_study import build as build_study
from synthetic_comparison import build, unchanged

from taichi_ants.analysis.sensitivity import COLUMNS


@pytest.fixture(scope="module")
def written():
    """The columns of each table, from small synthetic results."""
    comparison = build({"truncates": unchanged, "terminates": unchanged}, seeds=4)
    summaries = summarise(comparison)
    study = build_study(seeds=12, sizes=(1, 2))
    crossed = np.zeros((WINDOWS, len(LOADS), 2, 1), np.int64)
    return {
        "summary.csv": summaries[0].columns(),
        "table2.csv": table2(comparison, summaries, draws=20)[0].columns(),
        "behaviours.csv": summarise_behaviours(comparison)[0],
        "claims.csv": claims_rows(assess(comparison, CLAIMS))[0],
        "baselines.csv": Baseline._fields,
        "seeds.csv": rows_of_seeds(study, range(12))[0],
        "conditions.csv": condition_rows(study)[0].columns(),
        "differences.csv": difference_rows(judge_all(study))[0],
        "shares.csv": rows({Case(): {BRIDGES[0]: crossed}}, [0], 100)[0],
        "sensitivity.csv": COLUMNS,
    }


DECLARED = {**TABLES["compare"], **TABLES["colony"], **TABLES["bridge"]}
DECLARED["sensitivity.csv"] = TABLES["sweep"]["sensitivity.csv"]


@pytest.mark.parametrize("name", DECLARED)
def test_the_columns_of_a_table_are_declared_and_occur(name, written):
    declared, columns = DECLARED[name]["columns"], list(written[name])
    assert undeclared(declared, columns) == []
    for one in declared:
        assert undeclared([one], columns) != columns, one
