"""How `make docs` builds the site: guides, API reference, gallery of executed notebooks."""

import actuator_glue

project = 'actuator_glue'
author = 'actuator_glue maintainers'
release = actuator_glue.__version__
extensions = ['myst_nb', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
html_theme = 'furo'
html_title = f'actuator_glue {release}'
exclude_patterns = ['gallery/README.md']
# Names of types as the sources write them; links to other projects would need the network.
autodoc_typehints = 'signature'
autodoc_member_order = 'bysource'
napoleon_use_ivar = True
python_use_unqualified_type_names = True
myst_heading_anchors = 4
# A link that leads nowhere inside the site ends the build (`-W`); headings begin where they do.
suppress_warnings = ['myst.header', 'misc.highlighting_failure']
# Every notebook runs in the build, from the folder of the checkout's example data.
nb_execution_mode = 'force'
nb_execution_timeout = 900  # s; the first one may have to compile
nb_execution_raise_on_error = True
nb_execution_show_tb = True
