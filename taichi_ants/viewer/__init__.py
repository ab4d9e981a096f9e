"""Web pages that play recordings of ants: a single file, which needs no server and no network.

- `record_trace` and `record_colony` make a `Recording`; a `Recorder` makes its frames one at a time
  while your code runs the colony.
- `page` returns the page of a recording, and `save_page` writes it; notebooks show recordings.
"""

from taichi_ants.viewer.page import Recording, page, save_page
from taichi_ants.viewer.recorder import Recorder, record_colony, record_trace

__all__ = ["Recorder", "Recording", "page", "record_colony", "record_trace", "save_page"]
