"""The report: one page, its Markdown twin, and the data of every figure, built from the runs alone."""

from scla_mj.experiments.report.write import write_report

__all__ = ["write_report"]
