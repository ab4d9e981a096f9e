"""Reports of studies as web pages: one file each, without a network.

Templates (`*.html`) share one style (`report.css`) and one script (`report.js`); the viewer's
script plays what moves on them.
"""

from taichi_ants.report.colony import colony_page
from taichi_ants.report.comparison import comparison_page

__all__ = ["colony_page", "comparison_page"]
