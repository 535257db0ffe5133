"""Units in which laboratories give lengths and forces, as factors to SI."""

LENGTH = {
    'm': 1.0,
    'cm': 1e-2,
    'mm': 1e-3,
    'um': 1e-6,
    'µm': 1e-6,
    'μm': 1e-6,
    'in': 0.0254,
    'inch': 0.0254,
    'inches': 0.0254,
}
FORCE = {
    'N': 1.0,
    'kN': 1e3,
    'MN': 1e6,
    'lbf': 4.4482216152605,
    'lbs': 4.4482216152605,
    'kip': 4448.2216152605,
    'kips': 4448.2216152605,
}
