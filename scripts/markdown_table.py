"""Numbers and tables as Markdown. Used by scripts/validation and scripts/impact_tables.py. Standard library only."""


def number(x, digits=4):
    text = f"{x:.{digits}g}"
    return "0" if float(text) == 0 or abs(x) < 1e-12 else text


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]
    return "\n".join(lines)


def small(x, rounding):
    """Three digits of a defect; a bound for rounding errors, which differ between machines."""
    return number(x, 3) if x >= rounding else f"below {rounding:.0e}"
