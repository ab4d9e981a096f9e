"""A web page that plays what ants did: one file, without a server and without a network.

- `record_episode`, `record_trace` and `record_colony` make a `Recording`; a `Recorder` makes its
  frames one at a time, of a colony that somebody else moves on.
- `page` puts a recording into a page, `save_page` writes it, `frame` shows it in a notebook.
"""

from taichi_ants.viewer.frames import Recording
from taichi_ants.viewer.page import check_page, frame, notebook, page, save_page
from taichi_ants.viewer.recorder import Recorder, record_colony, record_episode, record_trace

__all__ = [
    "Recorder",
    "Recording",
    "check_page",
    "frame",
    "notebook",
    "page",
    "record_colony",
    "record_episode",
    "record_trace",
    "save_page",
]
