"""Charts of impulses against relative speed, angle of approach and mass. Standard library only.

Used by scripts/figures. Each function runs its studies and returns width, height and body of an SVG picture.
"""
import math

from impact_studies import ANGLE, CASES, GRIPS, MOTION, SPEED, along_speed, families, magnitude, sweep

CASE_COLOURS = {"case 1": "#2a6fbb", "case 2": "#5c6670", "case 3": "#c8553d", "case 4": "#b07a10"}
ANGLE_COLOURS = {0.0: "#2a6fbb", 30.0: "#2e8b57", 60.0: "#c8553d"}
MOTIONS = {"open": {"case 1": "turn alike", "case 2": "at rest", "case 3": "turn oppositely", "case 4": "only 2 turns"},
           "closed": {"case 1": "0.2 rad/s", "case 2": "at rest", "case 3": "-0.2 rad/s", "case 4": "0.2 rad/s, drifts"}}


class Chart:
    """A frame with linear axes: the map from data to pixels, and the drawn elements."""

    def __init__(self, left, top, width, height, x_range, y_range):
        self.left, self.top, self.width, self.height = left, top, width, height
        self.x_range, self.y_range = x_range, y_range
        self.parts = []

    def pixels(self, x, y):
        (x0, x1), (y0, y1) = self.x_range, self.y_range
        return self.left + self.width * (x - x0) / (x1 - x0), self.top + self.height * (y1 - y) / (y1 - y0)

    def grid(self, x_ticks, y_ticks, x_text="", y_text=""):
        """Lines at the ticks, given as values with labels; non-empty labels are written at the left and below."""
        bottom = self.top + self.height
        for value, label in x_ticks:
            x, _ = self.pixels(value, 0)
            self.parts.append(f'<line x1="{x:.1f}" y1="{self.top}" x2="{x:.1f}" y2="{bottom}" stroke="#e6e9ec"/>')
            if x_text:
                self.parts.append(f'<text x="{x:.1f}" y="{bottom + 17}" text-anchor="middle" font-size="12">{label}</text>')
        for value, label in y_ticks:
            _, y = self.pixels(0, value)
            self.parts.append(f'<line x1="{self.left}" y1="{y:.1f}" x2="{self.left + self.width}" y2="{y:.1f}" stroke="#e6e9ec"/>')
            if y_text:
                self.parts.append(f'<text x="{self.left - 7}" y="{y + 4:.1f}" text-anchor="end" font-size="12">{label}</text>')
        self.parts.append(f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}" fill="none" stroke="#aab0b6"/>')
        if x_text:
            self.text(self.left + self.width / 2, bottom + 36, x_text, size=13, anchor="middle")
        if y_text:
            self.parts.append(f'<text transform="translate({self.left - 44} {self.top + self.height / 2}) rotate(-90)" '
                              f'text-anchor="middle" font-size="13">{y_text}</text>')

    def curve(self, points, colour, dashes=""):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in (self.pixels(*p) for p in points))
        self.parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dashes}"/>')

    def dot(self, x, y, colour):
        x, y = self.pixels(x, y)
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.9" fill="{colour}"/>')

    def cross(self, x, row, colour):
        """A mark on the lower edge; rows are stacked upwards."""
        x, _ = self.pixels(x, 0)
        y = self.top + self.height - 8 - 9 * row
        self.parts.append(f'<path d="M{x - 3:.1f},{y - 3} l6,6 m0,-6 l-6,6" stroke="{colour}" stroke-width="1.3"/>')

    def text(self, x, y, text, colour="#222", size=12, anchor="start"):
        """At pixels."""
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{colour}" text-anchor="{anchor}">{text}</text>')

    def key(self, x, y, text, colour, dashes=""):
        """An entry of the legend, at pixels."""
        self.parts.append(f'<line x1="{x}" y1="{y - 4}" x2="{x + 22}" y2="{y - 4}" stroke="{colour}" stroke-width="1.8" '
                          f'stroke-dasharray="{dashes}"/>')
        self.text(x + 28, y, text)


def ticks(first, last, step, digits=0):
    return [(first + i * step, f"{first + i * step:.{digits}f}") for i in range(round((last - first) / step) + 1)]


def against_speed():
    """The counterparts of the thesis's Figures 4.18 and 4.20."""
    width, height, left, top, gap = 225, 220, 66, 64, 26
    parts = []
    for row, (loop, most, step) in enumerate((("open", 1.6, 0.4), ("closed", 4.0, 1.0))):
        table = sweep(f"thesis-{loop}-loop")
        y0 = top + row * (height + 76)
        for column, case in enumerate(CASES):
            chart = Chart(left + column * (width + gap), y0, width, height, (0, 0.2), (0, most))
            chart.grid(ticks(0, 0.2, 0.1, 1), ticks(0, most, step, 1), "relative speed [m/s]", "" if column else "|P| [N s]")
            chart.text(chart.left + 2, y0 - 8, f"{loop} loop, {case}: {MOTIONS[loop][case]}", size=12)
            for angle, colour in ANGLE_COLOURS.items():
                points = along_speed(table, case, angle)
                for grasp, dashes in zip(GRIPS, ("", "5 3")):
                    chart.curve([(r[SPEED], magnitude(r, grasp)) for r in points], colour, dashes)
            parts += chart.parts
    key = Chart(0, 0, 1, 1, (0, 1), (0, 1))
    for i, (angle, colour) in enumerate(ANGLE_COLOURS.items()):
        key.key(left + 150 * i, 28, f"θ_e = {angle:.0f}°", colour)
    key.key(left + 470, 28, "grasp 1", "#222")
    key.key(left + 580, 28, "grasp 2", "#222", "5 3")
    return left + 4 * (width + gap) + 4, top + 2 * (height + 76) - 24, "".join(key.parts + parts)


def against_angle():
    """Impulse against the angle of approach on a fine grid, at 0.1 m/s."""
    width, height, left, top, gap = 430, 260, 66, 64, 74
    parts = []
    for row, (loop, least, most, step) in enumerate((("open", -30, 1.0, 0.2), ("closed", -60, 2.8, 0.4))):
        table = sweep(f"thesis-{loop}-loop-angle")
        y0 = top + row * (height + 76)
        for column, grasp in enumerate(GRIPS):
            chart = Chart(left + column * (width + gap), y0, width, height, (least, 90), (0, most))
            chart.grid(ticks(least, 90, 30), ticks(0, most, step, 1), "angle of approach θ_e [°]", "|P| [N s]")
            chart.text(chart.left + 2, y0 - 8, f"{loop} loop, grasp {column + 1}, relative speed 0.1 m/s", size=13)
            for i, (case, colour) in enumerate(CASE_COLOURS.items()):
                points = [r for r in table if r[MOTION] == case]
                for part in families(points):
                    curve = [(r[ANGLE], magnitude(r, grasp)) for r in part]
                    chart.curve(curve, colour)
                    for x, y in curve:
                        chart.dot(x, y, colour)
                for r in points:
                    if r["status"] != "ok":
                        chart.cross(r[ANGLE], i, colour)
            parts += chart.parts
    key = Chart(0, 0, 1, 1, (0, 1), (0, 1))
    for i, (case, colour) in enumerate(CASE_COLOURS.items()):
        key.key(left + 120 * i, 28, case, colour)
    key.text(left + 490, 28, "×  no configuration found;  gaps: another family of configurations")
    return left + 2 * width + gap + 24, top + 2 * (height + 76) - 24, "".join(key.parts + parts)


def decades(first, last, every):
    return [(k, f'10<tspan dy="-5" font-size="9">{k}</tspan>') for k in range(first, last + 1, every)]


def against_mass():
    """Impulses and the base's disturbance against the target's mass, three dimensions; both axes logarithmic."""
    width, height, left, top, gap = 430, 300, 66, 44, 80
    table = sweep("mass-ratio")
    ratios = [math.log10(r["mass_ratio [1]"]) for r in table]
    impulses = Chart(left, top, width, height, (-6, 4), (-5, 2))
    impulses.grid(decades(-6, 4, 2), decades(-5, 2, 1), "mass of each target over the servicer's", "|P| [N s]")
    impulses.text(left + 2, top - 10, "impulse", size=13)
    for grasp, colour, y in zip(GRIPS, ("#2a6fbb", "#c8553d"), (24, 44)):
        impulses.curve([(x, math.log10(magnitude(r, grasp))) for x, r in zip(ratios, table)], colour)
        impulses.key(left + 16, top + y, f"grasp {grasp[-1]}", colour)
    base = Chart(left + width + gap, top, width, height, (-6, 4), (-8, -1))
    base.grid(decades(-6, 4, 2), decades(-8, -1, 1), "mass of each target over the servicer's", "[m/s], [rad/s]")
    base.text(base.left + 2, top - 10, "change of the base's velocity and angular velocity", size=13)
    for quantity, unit, colour, y in (("velocity_change", "m/s", "#2e8b57", 24), ("angular_velocity_change", "rad/s", "#b07a10", 44)):
        changes = [math.hypot(*(r[f"base/{quantity}/{c} [{unit}]"] for c in "xyz")) for r in table]
        base.curve([(x, math.log10(c)) for x, c in zip(ratios, changes)], colour)
        base.key(base.left + 16, top + y, f"{'angular ' if unit == 'rad/s' else ''}velocity [{unit}]", colour)
    return left + 2 * width + gap + 24, top + height + 52, "".join(impulses.parts + base.parts)
