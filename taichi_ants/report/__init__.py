"""The reports of studies as web pages: one file each, without a network.

- `comparison_page` tells the paper's comparison, `colony_page` the study of the colony.
- Both are filled into templates (`*.html`) with one style (`report.css`) and one script
  (`report.js`); what moves on them is played by the viewer's script.
"""

from taichi_ants.report.colony import colony_page
from taichi_ants.report.comparison import comparison_page

__all__ = ["colony_page", "comparison_page"]
