"""Okabe and Ito's palette, which colour-blind people can distinguish too, and what it stands for in maps."""

BLACK, ORANGE, GREEN, BLUE, VERMILLION, PURPLE, SKY_BLUE = (
    *("#000000", "#E69F00", "#009E73", "#0072B2", "#D55E00", "#CC79A7", "#56B4E9"),
)
PATH_COLOR, LOOP_COLOR, START_COLOR, END_COLOR, DOUBT_COLOR = BLUE, VERMILLION, GREEN, PURPLE, ORANGE
TRUTH_COLOR = BLACK
PLAN_COLOR = SKY_BLUE
LINE_COLORS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY_BLUE)
"""Colours of curves in one plot, in this order."""
FRAME_COLOR, QUIET_COLOR = "#9aa3ad", "#5b6570"
"""Colours of frames around maps, and of text beside them."""
