"""Converts equations in plain text, as pages of docs/ write them, to TeX. Standard library only.

Pages write equations in ```text blocks with Unicode symbols; a number such as (7.3) ends a line:

    J_g = J_m − J_b I_b⁻¹ I_bm                    (2.5)

Conventions: `_` starts a subscript; superscripts are Unicode or follow `^`; " x " and "×" are the cross product; `[a; b]` stacks
blocks; two spaces separate the columns of a matrix; three spaces separate statements; matrices may extend over several lines.
Words of prose stay upright. Blocks that are mostly words, and those with unknown symbols, raise NotAnEquation.
"""
import re
import unicodedata

GAP = "\0"  # in TeX: between statements of a line
NUMBER = re.compile(r"\s\((\d+\.\d+[a-z]?)\)\s*$")
MARKS = {"\u0307": "dot", "\u0308": "ddot", "\u0302": "hat", "\u0303": "tilde", "\u0304": "bar"}
SUPERSCRIPTS = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ⁿᵀ⁽⁾ⁱ", [*"0123456789", "+", "-", "n", r"\mathsf{T}", "(", ")", "i"]))
SUBSCRIPTS = dict(zip("₀₁₂₃₄₅₆₇₈₉₊₋", [*"0123456789", "+", "-"]))
SYMBOLS = {
    "=": "=", "<": "<", ">": ">", "+": "+", "-": "-", "−": "-", "/": "/", ",": ",", ";": r";\;", ".": ".", ":": r"\text{:}\;", "!": "!",
    "·": r"\cdot ", "×": r"\times ", "∘": r"\circ ", "⊗": r"\otimes ", "⊕": r"\oplus ", "±": r"\pm ", "∓": r"\mp ", "≤": r"\le ",
    "≥": r"\ge ", "≠": r"\ne ", "≈": r"\approx ", "→": r"\to ", "←": r"\leftarrow ", "⇒": r"\Rightarrow ", "∈": r"\in ", "∞": r"\infty ",
    "…": r"\dots ", "∂": r"\partial ", "∇": r"\nabla ", "|": "|", "‖": r"\|", "*": "*", "½": r"\tfrac12 ", "¼": r"\tfrac14 ",
    "∫": r"\int ", "%": r"\%", "°": r"^\circ ", "–": r"\text{–}", "{": r"\{", "}": r"\}", "(": "(", ")": ")", "[": "[", "]": "]",
    "⊥": r"\perp ", "∪": r"\cup ", "∩": r"\cap ", "≡": r"\equiv ", "∝": r"\propto ", "𝓜": r"\mathcal{M}", "ℓ": r"\ell ",
    "“": r"\text{“}", "”": r"\text{”}", "⟨": r"\langle ", "⟩": r"\rangle ", "'": "'", "′": "'",
}  # fmt: skip
RELATIONS = "=≤≥<>≈←"
FUNCTIONS = set("sin cos tan exp log ln min max tanh sign diag det argmin argmax shift clamp law conj round atan tr Im Re sup".split())
ARTICLE = re.compile(r"a (?!(?:the|if|for|of|is|in|at|on|then|over|from|with|and|or)\b)[a-z]{2,}")
WORD = re.compile(r"[A-Za-z]{2,}(?:(?:[-–'’.](?=[A-Za-z]{2})|['’](?=s\b))[A-Za-z]+)*")
SNAKE = re.compile(r"[A-Za-z]{2,}(?:_[a-z]{3,})+|_[a-z]{3,}")
PLAIN = {"q̇uat": r"\dot{\mathrm{quat}}", "atan2": r"\operatorname{atan2}"}
MATRICES_SIGMA = {"7.5", "7.6", "7.7", "13.11", "13.12", "13.13", "16.7", "16.8"}  # Σ is a matrix in these


class NotAnEquation(ValueError):
    pass


def clusters(text):
    """Letters, each with its marks: what has a width of one column."""
    text = "".join(unicodedata.normalize("NFD", c) if c.isalpha() else c for c in unicodedata.normalize("NFC", text))
    result = []
    for c in text:
        if unicodedata.combining(c) and result:
            result[-1] += c
        else:
            result.append(c)
    return result


class Line:
    """Converts one line; `at` is the position."""

    def __init__(self, text, sigma=False):
        self.s, self.at, self.sigma = clusters(text) if isinstance(text, str) else list(text), 0, sigma

    def peek(self, offset=0):
        i = self.at + offset
        return self.s[i] if 0 <= i < len(self.s) else ""

    def rest(self):
        return "".join(self.s[self.at:])

    def take(self, characters):
        """Consumes so many code points."""
        while characters > 0:
            characters -= len(self.s[self.at])
            self.at += 1

    def closing(self, start):
        """Where the bracket at `start` closes; None where it does not."""
        open_, close = self.s[start], {"(": ")", "[": "]", "{": "}"}[self.s[start]]
        depth = 0
        for i in range(start, len(self.s)):
            depth += (self.s[i] == open_) - (self.s[i] == close)
            if depth == 0:
                return i
        return None

    def inner(self, text):
        return Line(text, self.sigma).all(inside=True)

    def all(self, inside=False):
        parts = []
        while self.at < len(self.s):
            c = self.peek()
            if c == " ":
                end = self.at
                while end < len(self.s) and self.s[end] == " ":
                    end += 1
                gap, self.at = end - self.at, end
                if gap == 1 and parts and self.at < len(self.s):
                    parts.append(r"\mkern2mu ")
                elif parts and self.at < len(self.s):
                    parts.append(r"\;" if inside else GAP)
                continue
            parts.append(self.atom())
        return "".join(parts)

    def atom(self):
        base = self.base()
        below, above = "", ""
        while True:
            c = self.peek()
            if c in SUPERSCRIPTS:
                above += SUPERSCRIPTS[c]
                self.at += 1
            elif c in SUBSCRIPTS:
                below += SUBSCRIPTS[c]
                self.at += 1
                if match := re.match(r",[a-z](?!\w)", self.rest()):
                    below += match[0]
                    self.take(2)
            elif c == "*" and self.peek(-1) not in (" ", "") and self.peek(1) != "(":
                above += "*"
                self.at += 1
            elif c in ("'", "′") and not re.match(r"['’]s\b", self.rest()):
                above += r"\prime "
                self.at += 1
            elif c == "_" and not below:
                self.at += 1
                below = self.script()
            elif c == "^":
                self.at += 1
                above += self.script(superscript=True)
            else:
                break
        if (below or above) and not base.strip():
            raise NotAnEquation("a script without a base")
        return base + (f"_{{{below}}}" if below else "") + (f"^{{{above}}}" if above else "")

    def script(self, superscript=False):
        if self.peek() in ("(", "{"):
            end = self.closing(self.at)
            if end is None:
                raise NotAnEquation("a bracket does not close")
            text, self.at = self.s[self.at + 1:end], end + 1
            return self.inner(text)
        text = []
        if self.peek() in ("−", "-", "+") or superscript and self.peek() == "½":
            text.append(self.peek())
            self.at += 1
            if self.peek() == "½":
                text.append("½")
                self.at += 1
            return "".join(SYMBOLS.get(c, c).replace("tfrac", "frac") if c != "½" else "1/2" for c in text) + ("" if text[-1] == "½" else self.script())
        while self.peek() and (self.peek()[0].isalnum() and self.peek() not in SUPERSCRIPTS and self.peek() not in SUBSCRIPTS):
            text.append(self.peek())
            self.at += 1
            if superscript and len(text) == 1:
                break
            if not superscript and self.peek() in (",", "−", "+") and re.match(r"[,−+][A-Za-z0-9](?![A-Za-z]*\()", self.rest()):
                text.append(self.peek())
                self.at += 1
        if not text:
            raise NotAnEquation("an empty script")
        return "".join(self.subscript_part(part) for part in re.split(r"([,−+])", "".join(text)))

    @staticmethod
    def subscript_part(part):
        if part in (",", "−", "+", ""):
            return {"−": "-"}.get(part, part)
        if re.fullmatch(r"[A-Za-z]{3,}\d*", part):
            return rf"\mathrm{{{part}}}"
        return "".join(letter(c) for c in clusters(part))

    def base(self):
        rest, c = self.rest(), self.peek()
        for plain, tex in PLAIN.items():
            plain = "".join(clusters(plain))
            if rest.startswith(plain):
                self.take(len(plain))
                return tex
        if (match := SNAKE.match(rest)) and not (match[0].split("_")[0] in FUNCTIONS):
            self.take(len(match[0]))
            name = match[0].replace("_", r"\_")
            return rf"\text{{{name}}}"
        if match := re.match(r"\d+(?:\.\d+)?e[-−+]?\d+", rest):
            self.take(len(match[0]))
            mantissa, exponent = match[0].replace("−", "-").split("e")
            return ("" if mantissa == "1" else mantissa + r"\cdot ") + f"10^{{{int(exponent)}}}"
        if match := re.match(r"\d+(?:\.\d+)?", rest):
            self.take(len(match[0]))
            return match[0]
        if match := re.match(r"[A-Z]\(\d+\.\d+\)(?:, [A-Z]\(\d+\.\d+\))*", rest):  # an equation of the thesis
            self.take(len(match[0]))
            return rf"\text{{{match[0]}}}"
        if rest.startswith("x") and (times := self.cross(rest)):
            return times
        if words := self.words(rest):
            return words
        if c == "√":
            return self.root()
        if c == "Σ":
            self.at += 1
            return r"\Sigma " if self.sigma else r"\textstyle\sum "
        if c in ("[", "(") and (end := self.closing(self.at)) is not None:
            text, self.at = self.s[self.at + 1:end], end + 1
            return self.group(c, text)
        if rest.startswith("+="):
            self.at += 2
            return r"\mathrel{+}="
        if c in ("'", "’") and re.match(r"['’]s\b", rest):
            self.take(2)
            return r"\text{’s }" if self.peek() == " " else r"\text{’s}"
        if re.match(r"-[a-z]{3,}", rest) and self.peek(-1) not in (" ", ""):
            self.at += 1
            return r"\text{-}"
        if c == "." and re.match(r"\.[a-z]{2,}", rest):
            word = re.match(r"\.[a-z]+", rest)[0]
            self.take(len(word))
            return rf"\text{{{word}}}"
        self.at += 1
        return letter(c)

    def cross(self, rest):
        before, after = "".join(self.s[:self.at]), rest[1:]
        if not after and re.fullmatch(r"\w ", before):  # [r x]
            self.at += 1
            return r"\times "
        if re.match(" +x", after):  # x xᵀ
            return None
        if not before.endswith(" ") or not before.strip() or before.rstrip()[-1] in "=+−-,;:(/<>≤":
            return None
        if match := re.match(r"\*?(?= +[\w(\[−√∫|]|\])", after):
            if after.startswith(" ") and re.match(r" +[−-] ", after):
                return None
            self.take(1 + len(match[0]))
            return r"\mathbin{\times^{*}}" if match[0] else r"\times "
        return None

    def words(self, rest):
        """Prose, up to what is not."""
        text, position = "", 0
        while True:
            if (article := ARTICLE.match(rest[position:])) and (position or self.peek(-1) in (" ", "")):
                text, position = text + "a ", position + 2
                continue
            match = WORD.match(rest[position:])
            if not match or match[0] in FUNCTIONS or SNAKE.match(rest[position:]):
                break
            word = match[0]
            if len(word) == 2 and not word.islower():
                break
            if re.fullmatch("d[a-np-z]", word):  # a differential
                if text:
                    break
                space = r"\," if self.peek(-1) == " " else ""
                self.take(2)
                return space + word
            text, position = text + word, position + len(word)
            if rest[position:position + 1] in (" ", ",", ":") and re.match(r"[,:]? (?=[a-zA-Z(]{2}|\(?[a-z]{3})", rest[position:]):
                gap = re.match(r"[,:]? ", rest[position:])[0]
                following = rest[position + len(gap):]
                if WORD.match(following) or ARTICLE.match(following):
                    text, position = text + gap, position + len(gap)
                    continue
            break
        if not text:
            match = WORD.match(rest)
            if match and match[0] in FUNCTIONS:
                self.take(len(match[0]))
                return rf"\operatorname{{{match[0]}}}"
            if match and len(match[0]) == 2:
                self.at += 1
                return rest[0]
            return None
        text = text.rstrip()
        before = " " if self.peek(-1) == " " else ""
        self.take(position if rest[:position].rstrip() == text else len(text))
        after = " " if re.match(r" [^ =<>≤≥≈+−]", rest[len(text):]) else ""
        if before and self.at and "".join(self.s[:self.at]).endswith("  "):
            before = ""
        return rf"\text{{{before}{text}{after}}}"

    def root(self):
        self.at += 1
        if self.peek() == "(":
            end = self.closing(self.at)
            if end is None:
                raise NotAnEquation("a bracket does not close")
            text, self.at = self.s[self.at + 1:end], end + 1
            return rf"\sqrt{{{self.inner(text)}}}"
        return rf"\sqrt{{{self.atom()}}}"

    def group(self, bracket, text):
        if bracket == "(":
            return f"({self.inner(text)})"
        rows = split(text, ";")
        cells = [columns(row) for row in rows]
        if len(rows) > 1 and all(len(row) == 1 for row in cells):
            atoms = [re.split(r" +", "".join(row).strip()) for row in rows]
            if all(len(row) == len(rows) and all(re.fullmatch(r"\d|\w_\d", atom) for atom in row) for row in atoms):
                cells = atoms
        if len(rows) == 1 and len(cells[0]) == 1:
            return f"[{self.inner(text)}]"
        return matrix([[self.inner(cell) for cell in row] for row in cells])


def letter(c):
    """A symbol with its marks."""
    if len(c) == 1 and c in SUPERSCRIPTS | SUBSCRIPTS:
        raise NotAnEquation("a script without a base")
    symbol, marks = c[0], c[1:]
    if symbol in SYMBOLS:
        tex = SYMBOLS[symbol]
    elif symbol.isalnum() and (symbol.isascii() or "\u0370" <= symbol <= "\u03ff"):
        tex = symbol
    else:
        raise NotAnEquation(f"the symbol {symbol!r}")
    for mark in marks:
        if mark not in MARKS:
            raise NotAnEquation(f"the mark {mark!r}")
        tex = rf"\{MARKS[mark]}{{{tex}}}"
    return tex


def split(text, separator):
    """Parts of a list of clusters, separated outside brackets."""
    parts, depth = [[]], 0
    for c in text:
        depth += (c in ("(", "[")) - (c in (")", "]"))
        if c == separator and depth == 0:
            parts.append([])
        else:
            parts[-1].append(c)
    return parts


def columns(row):
    """Cells of a row of a matrix: two spaces separate them, outside brackets."""
    cells, depth, i = [[]], 0, 0
    while i < len(row):
        depth += (row[i] in ("(", "[")) - (row[i] in (")", "]"))
        if row[i] == " " and depth == 0 and i + 1 < len(row) and row[i + 1] == " ":
            while i < len(row) and row[i] == " ":
                i += 1
            cells.append([])
            continue
        cells[-1].append(row[i])
        i += 1
    cells = ["".join(cell).strip().rstrip(",") for cell in cells]
    return [cell for cell in cells if cell] or [""]


def matrix(rows):
    return r"\begin{bmatrix}" + r"\\{}".join("&".join(row) for row in rows) + r"\end{bmatrix}"


def brackets(line):
    """The outermost square brackets of a line of clusters: pairs of columns."""
    pairs, depth = [], 0
    for i, c in enumerate(line):
        if c == "[":
            depth += 1
            if depth == 1:
                start = i
        elif c == "]" and depth:
            depth -= 1
            if depth == 0:
                pairs.append((start, i))
    return pairs


def drawn_matrices(lines):
    """Groups of lines: those over which a matrix extends are one group. Yields (lines, their brackets)."""
    def alike(one, other):
        return len(one) == len(other) > 0 and all(abs(a - c) <= 2 and abs(b - d) <= 2 for (a, b), (c, d) in zip(one, other))

    def of_drawing(line, pairs):
        return all(line[a + 1] == " " == line[b - 1] and ";" not in line[a:b] for a, b in pairs)

    i = 0
    while i < len(lines):
        pairs, end = [brackets(lines[i])], i + 1
        while end < len(lines) and of_drawing(lines[i], pairs[0]) and alike(pairs[0], own := brackets(lines[end])):
            pairs.append(own)
            end += 1
        yield lines[i:end], pairs if end - i > 1 else []
        i = end


def drawn(lines, pairs, sigma):
    """One line of TeX for lines over which matrices extend."""
    parts, positions = [], [0] * len(lines)
    for k in range(len(pairs[0]) + 1):
        last = k == len(pairs[0])
        between = ["".join(line[position:None if last else own[k][0]]) for line, position, own in zip(lines, positions, pairs)]
        text = " ".join(part.strip() for part in between if part.strip())
        if parts and len(between[0]) > 3 and not any(c in RELATIONS + "+−" for c in text[:1]):
            parts.append(GAP if text else r"\;")
        parts.append(Line(text, sigma).all())
        if last:
            break
        insides = [line[own[k][0] + 1:own[k][1]] for line, own in zip(lines, pairs)]
        starts = sorted({i for inside in insides for i in cell_starts(inside)})
        rows = []
        for inside in insides:
            own = cell_starts(inside)
            cells = {start: "".join(inside[start:end]).strip() for start, end in zip(own, [*own[1:], len(inside)])}
            rows.append([Line(cells.get(start, ""), sigma).all() for start in starts])
        parts.append(matrix(rows))
        positions = [own[k][1] + 1 for own in pairs]
    return "".join(parts)


def cell_starts(inside):
    """Where the cells of a row begin: after two spaces, or one beside the bracket."""
    return [i for i, c in enumerate(inside) if c != " " and "".join(inside[max(0, i - 2):i]) in ("", " ", "  ")]


def mostly_words(text):
    """Whether a block is a table or a procedure rather than equations."""
    lines = [line for line in text.split("\n") if line.strip()]
    names = sum(bool(re.search(r"[a-z]{3,}_[a-z]{3,}", line)) for line in lines)
    if re.match(r"\d\. ", lines[0]) or names > 1:
        return True
    if len(lines) > 1 and 2 * sum(any(c in line for c in RELATIONS + "≠[") for line in lines) < len(lines):
        return True
    text = re.sub(r"\([^()]* [^()]*\)", "", NUMBER.sub("", text))
    prose = sum(len(w) for w in re.findall(r"(?<![\w.])[A-Za-z]{3,}(?![\w(:])", text) if w not in FUNCTIONS)
    return prose > 0.8 * len(re.sub(r"\s", "", text))


def left_and_right(source):
    """Where the left side of a statement ends: after a label, or before its first relation; None where neither is near."""
    if label := re.match(r"[A-Za-z][A-Za-z–_, ]{2,40}?:?(?=  +\S)|[A-Za-z][\w– ]{1,40}:(?= )", source):
        return label.end()
    match = re.match(r"(\S.{0,24}?) +([=≤≥≈←]|\+=) ", source)
    if not match or re.search(r"  |[,:]", match[1]) or match[1].count("(") != match[1].count(")") or match[1].count("[") != match[1].count("]"):
        return None
    return match.end(1)


def rows_of(text):
    """The rows of a block: (left side or "", right side, number or None), in TeX with GAP between statements."""
    if mostly_words(text):
        raise NotAnEquation("it is mostly words")
    lines, numbers = [], []
    for line in text.rstrip("\n").split("\n"):
        number = NUMBER.search(line)
        lines.append(clusters(line[:number.start()].rstrip() if number else line.rstrip()))
        numbers.append(number[1] if number else None)
    sigma = any(number in MATRICES_SIGMA for number in numbers)
    rows, i = [], 0
    for group, pairs in drawn_matrices(lines):
        number = next((n for n in numbers[i:i + len(group)] if n), None)
        i += len(group)
        source = "".join(group[0])
        if pairs:
            rows.append(("", drawn(group, pairs, sigma), number))
        elif source.strip():
            source = source.strip()
            at = left_and_right(source)
            if at:
                right = source[at:].strip()
                relation = "{}" if right[0] in RELATIONS + "+" else ""  # for its space
                rows.append((Line(source[:at], sigma).all(), relation + Line(right, sigma).all(), number))
            else:
                rows.append(("", Line(source, sigma).all(), number))
    if len(rows) == 1 or not all(left for left, _, _ in rows):
        rows = [("", left + ("" if right.startswith("{}") or not left else GAP) + right, number) for left, right, number in rows]
    return rows
