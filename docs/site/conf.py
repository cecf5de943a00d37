"""Sphinx: what build.py runs it with. The pages are Markdown as a code host shows it; nothing is fetched from anywhere."""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

project = "Solenoid"
version = release = os.environ["SOLENOID_VERSION"]
extensions = ["myst_parser", "sphinx_solenoid"]
api_tags = os.environ["SOLENOID_API_TAGS"]

myst_heading_anchors = 4  # the anchors that a code host gives headings
smartquotes = False  # an option's two dashes stay two
highlight_language = "none"

html_theme = "furo"
html_title = f"Solenoid {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # a page in a file may not read its neighbours
html_show_copyright = False
