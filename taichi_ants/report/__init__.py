"""Reports of studies as web pages: one file each, without a network.

Templates (`*.html`) share one style (`report.css`) and one script (`report.js`); the viewer's
script plays what moves on them.
"""
