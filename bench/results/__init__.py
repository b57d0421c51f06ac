"""Results of several jobs side by side: changes between two of them, tables over many."""

from bench.results.comparison import ParameterChange, ResultChanges, compare_results
from bench.results.table import Batch, BatchRow, make_batch_view, write_csv

__all__ = [
    "Batch",
    "BatchRow",
    "ParameterChange",
    "ResultChanges",
    "compare_results",
    "make_batch_view",
    "write_csv",
]
