"""Reports of studies as web pages: one file each, which works offline.

Templates (`*.html`) share one style (`report.css`) and one script (`report.js`); the scripts of the
viewer play the recordings.
"""
