"""OBJ text: reads the statements of an OBJ file into arrays, in pieces, without a Python object for each line.

The words of a piece are found with NumPy. Python looks only at lines that are neither numbers nor corners, such as "usemtl",
and at the lines of a piece in which NumPy met something that is no number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.errors import printable
from glshade.mesh.reading.file import MeshFile

# The bytes of a piece. Its words take about ten times as much memory while they are found.
PIECE = 8 << 20
# The bytes of a line, which is read at once. A face of the largest number of corners takes less.
LONGEST_LINE = 32 << 20
# The index of a position, uv or normal that a corner does not have, and of one that the file does not hold.
ABSENT, BEYOND = -1, 2**31 - 1

# The statements of numbers and of corners. A line's kind is the place of its first word here; others have the kind OTHER.
_WORDS = (b"v", b"vt", b"vn", b"f", b"l", b"p")
V, VT, VN, FACE, LINE, POINT = range(len(_WORDS))
_OTHER, _NOTHING = len(_WORDS), len(_WORDS) + 1
# The least number of numbers in a statement.
_LEAST = {V: 3, VT: 1, VN: 3}
# The statements that change the state in which elements are read, and those that name other files.
STATES = frozenset({"o", "g", "s", "usemtl", "mtllib"})
# The statements for which there is a warning. The remaining ones only matter to programs of their time.
_FREE_FORM = frozenset({"curv", "curv2", "surf"})
_FILES = frozenset({"call", "csh"})

# The first letters of these statements. Lines with another one are not looked at.
_HEADS = np.array([ord(head) for head in sorted({word[0] for word in STATES | _FREE_FORM | _FILES})], dtype=np.uint8)

# The numbers that each form of corner holds, as columns of a corner: v, v/vt, v//vn and v/vt/vn.
_FORMS = ((0,), (0, 1), (0, 2), (0, 1, 2))
_CORNER = re.compile(rb"[-+]?\d+(/([-+]?\d+)?(/([-+]?\d+)?)?)?")
# The number at the beginning of a word, which is all that programs in C read of "3.1+e2".
_BEGIN = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_OF_CORNERS = np.zeros(256, dtype=bool)
_OF_CORNERS[list(b"0123456789+-/")] = True
_OF_CORNERS[list(b" \t\n\v\f\r")] = True


@dataclass
class ObjText:
    """The statements of an OBJ file.

    positions: (V, 3) float64.
    colours: (V, 4) sRGB-encoded colours with alpha; None where no vertex has one.
    uvs: (U, 2) float64.
    normals: (N, 3) float64.
    kinds: (E,) FACE, LINE or POINT for each element.
    counts: (E,) the number of corners of each element.
    lines: (E,) the number of the line of each element, from 1.
    corners: (C, 3) int32, the indices of position, uv and normal from 0, or ABSENT or BEYOND, element by element.
    states: the statements of STATES in their order: the number of the line, the first word and the rest of the line.
    free_form: whether the file has free-form curves or surfaces.
    """

    positions: Float64
    colours: Float64 | None
    uvs: Float64
    normals: Float64
    kinds: Array
    counts: Array
    lines: Array
    corners: Array
    states: list[tuple[int, str, str]]
    free_form: bool


def read_text(file: MeshFile) -> ObjText:
    """Returns the statements of an OBJ file. Errors: AssetError, with the number of the line."""
    reader = _Reader(file)
    for piece, line in _pieces(file):
        reader.read(piece, line)
    return reader.text()


def _pieces(file: MeshFile) -> Iterator[tuple[bytes, int]]:
    """Yields pieces of the file's text that end with a line, and the number of the first line of each.

    A text in UTF-16 becomes one in UTF-8. Errors: AssetError for a line that is too long.
    """
    data = file.data
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", errors="replace").encode()
    elif data[1:2] == b"\0" or data[:1] == b"\0":
        little = data[1:2] == b"\0"
        data = data.decode("utf-16-le" if little else "utf-16-be", errors="replace").encode("utf-8", errors="replace")
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = re.sub(rb"\r(?!\n)", b"\n", data)
    start, line = 0, 1
    while start < len(data):
        end = start + PIECE
        while True:
            end = data.find(b"\n", end) + 1 or len(data)
            # A line that ends with a backslash goes on in the next one.
            if end == len(data) or not data[max(end - 3, start) : end - 1].removesuffix(b"\r").endswith(b"\\"):
                break
            if end - start > PIECE + LONGEST_LINE:
                break
        if end - start > PIECE + LONGEST_LINE:
            raise file.fail(f"a line after line {line:,} has more than {LONGEST_LINE:,} bytes; split its elements")
        piece = data[start:end]
        yield (piece if piece.endswith(b"\n") else piece + b"\n"), line
        line += piece.count(b"\n")
        start = end


@dataclass
class _Reader:
    """Everything that was read so far. The arrays of the pieces are put together at the end."""

    file: MeshFile
    positions: list[Float64] = field(default_factory=list)
    # The number of positions in each piece.
    sizes: list[int] = field(default_factory=list)
    # The four numbers that may follow a position, and how many numbers its line has, for each piece; None for one without.
    beyond: list[tuple[Float64, Array] | None] = field(default_factory=list)
    uvs: list[Float64] = field(default_factory=list)
    normals: list[Float64] = field(default_factory=list)
    kinds: list[Array] = field(default_factory=list)
    counts: list[Array] = field(default_factory=list)
    lines: list[Array] = field(default_factory=list)
    corners: list[Array] = field(default_factory=list)
    states: list[tuple[int, str, str]] = field(default_factory=list)
    # The number of positions, uvs and normals.
    held: list[int] = field(default_factory=lambda: [0, 0, 0])
    free_form: bool = False

    def read(self, text: bytes, first_line: int) -> None:
        """Reads one piece. Errors: AssetError."""
        piece = _Piece(text, first_line)
        before = [self.held[kind] + np.cumsum(piece.kinds == kind) for kind in (V, VT, VN)]
        for kind, store in ((VT, self.uvs), (VN, self.normals)):
            rows = self._rows(piece, kind)[0]
            store.append(rows[:, :2] if kind == VT else rows[:, :3])
        self._positions(*self._rows(piece, V))
        self._elements(piece, before)
        self.held = [int(count[-1]) for count in before]
        for line, word, rest in piece.others():
            if word in STATES:
                self.states.append((line, word, rest))
            elif word in _FREE_FORM:
                self.free_form = True
            elif word in _FILES:
                self.file.warn(f"'{word}' names a file of statements, which is not read")

    def _positions(self, rows: Float64, widths: Array) -> None:
        self.positions.append(rows[:, :3].copy())
        self.sizes.append(len(rows))
        if rows.shape[1] > 3 and len(rows):
            wide = np.zeros((len(rows), 4))
            wide[:, : rows.shape[1] - 3] = rows[:, 3:7]
            if ((widths == 4) & (wide[:, 0] != 1)).any():
                self.file.warn("the weights of vertices only matter to free-form surfaces; they are left out")
            self.beyond.append((wide, widths) if (widths >= 6).any() else None)
        else:
            self.beyond.append(None)

    def _rows(self, piece: _Piece, kind: int) -> tuple[Float64, Array]:
        """Returns the numbers (n, 3 to 7) of all lines of a kind, with 0 for absent ones, and how many each holds (n,)."""
        lines = np.flatnonzero(piece.kinds == kind)
        widths = piece.words[lines] - 1
        if not len(lines):
            return np.zeros((0, 3)), widths
        if widths.min() < _LEAST[kind]:
            line = piece.number(lines[int((widths < _LEAST[kind]).argmax())])
            raise self.file.fail(f"line {line}: '{_WORDS[kind].decode()}' needs at least {_LEAST[kind]} numbers")
        rows = np.zeros((len(lines), max(3, min(int(widths.max()), 7))))
        for width in np.unique(widths).tolist():
            chosen = np.flatnonzero(widths == width)
            rows[chosen, : min(width, 7)] = self._numbers(piece, lines[chosen], width)[:, :7]
        return rows, widths

    def _numbers(self, piece: _Piece, lines: Int64, width: int) -> Float64:
        """Returns the numbers (n, width) of lines (n,) that hold `width` numbers each."""
        text = piece.bytes_of(lines)
        try:
            values = np.fromstring(text, sep=" ")
            if len(values) == len(lines) * width:
                return values.reshape(-1, width)
        except (ValueError, DeprecationWarning):  # older NumPy warns where newer NumPy raises
            pass
        split = text.split(b"\n")
        return np.array(
            [[self._number(word, piece.number(n)) for word in t.split()] for n, t in zip(lines, split, strict=False)]
        )

    def _number(self, word: bytes, line: int) -> float:
        try:
            return float(word)
        except ValueError:
            # Microsoft's C library writes NaN as "-1.#IND" or "-nan(ind)", and infinity as "1.#INF".
            if b".#" in word or b"nan" in word.lower():
                return math.nan
            begin = _BEGIN.match(word)
            if begin is None or b"," in word:
                raise self.file.fail(f"line {line}: '{_shown(word)}' is not a number") from None
            self.file.warn(f"line {line}: '{_shown(word)}' is not a number; read as {begin[0].decode()}")
            return float(begin[0])

    def _elements(self, piece: _Piece, before: list[Int64]) -> None:
        lines = np.flatnonzero((piece.kinds >= FACE) & (piece.kinds <= POINT))
        if not len(lines):
            return
        counts = piece.words[lines] - 1
        corners = np.zeros((int(counts.sum()), 3), dtype=np.int64)
        if len(corners):
            self._corners(piece, lines, counts, corners)
        for column, held in enumerate(before):
            index = corners[:, column]
            negative = np.flatnonzero(index < 0)
            absent = index == 0
            index -= 1
            if len(negative):
                # A negative index counts back from the last one that was read before the line.
                of_line = np.searchsorted(np.cumsum(counts), negative, side="right")
                index[negative] += held[lines[of_line]] + 1
            index[(index < 0) | (index > BEYOND)] = BEYOND
            index[absent] = BEYOND if column == 0 else ABSENT
        self.kinds.append(piece.kinds[lines])
        self.counts.append(counts)
        self.lines.append(piece.numbers[lines])
        self.corners.append(corners.astype(np.int32))

    def _corners(self, piece: _Piece, lines: Int64, counts: Int64, corners: Int64) -> None:
        """Fills the corners (C, 3) with the numbers that are written in lines, and 0 for those that are left out."""
        starts, ends = piece.words_of(lines)
        text = piece.array
        slashes = np.flatnonzero(text == ord("/"))
        doubles = slashes[:-1][np.diff(slashes) == 1]
        forms: Array = np.zeros(len(starts), dtype=np.int8)
        wrong = not _OF_CORNERS[np.frombuffer(piece.bytes_of(lines), dtype=np.uint8)].all()
        if len(slashes):
            number = np.searchsorted(slashes, ends) - np.searchsorted(slashes, starts)
            double = np.searchsorted(doubles, ends) > np.searchsorted(doubles, starts) if len(doubles) else np.zeros(1, bool)
            trailing = text[ends - 1] == ord("/")
            wrong |= bool((number > 2).any() or (text[starts] == ord("/")).any())
            forms = np.where(number == 2, np.where(double, 2, 3), number).astype(np.int8)
            if trailing.any():  # "1/" and "1//" are "1", and "1/2/" is "1/2"
                forms[trailing] = np.where((number == 2) & ~double, 1, 0)[trailing]
        if not wrong:
            for form in np.unique(forms).tolist():
                chosen = forms == form
                written = piece.bytes_of(lines) if chosen.all() else piece.bytes_between(starts[chosen], ends[chosen])
                try:
                    numbers = np.fromstring(written.replace(b"/", b" "), dtype=np.int64, sep=" ")
                    corners[np.ix_(chosen, _FORMS[form])] = numbers.reshape(-1, len(_FORMS[form]))
                except (ValueError, DeprecationWarning):
                    wrong = True
        if wrong:
            for at, (start, end) in enumerate(zip(starts, ends, strict=True)):
                word = text[start:end].tobytes()
                if not _CORNER.fullmatch(word):
                    line = piece.number(lines[int(np.searchsorted(np.cumsum(counts), at, side="right"))])
                    raise self.file.fail(f"line {line}: '{_shown(word)}' is not a corner of a face; write v, v/vt or v/vt/vn")

    def text(self) -> ObjText:
        """Returns everything. The lists are emptied, so that each array exists twice for a moment only."""
        return ObjText(
            positions=_joined(self.positions, (0, 3), np.float64),
            colours=self._colours(),
            uvs=_joined(self.uvs, (0, 2), np.float64),
            normals=_joined(self.normals, (0, 3), np.float64),
            kinds=_joined(self.kinds, (0,), np.int64),
            counts=_joined(self.counts, (0,), np.int64),
            lines=_joined(self.lines, (0,), np.int64),
            corners=_joined(self.corners, (0, 3), np.int32),
            states=self.states,
            free_form=self.free_form,
        )

    def _colours(self) -> Float64 | None:
        """Returns the colours (V, 4). Vertices without one are white where others have one.

        Six numbers are x y z r g b. Seven are x y z w r g b if w is 1 in all of them, and x y z r g b a otherwise.
        """
        if all(piece is None for piece in self.beyond):
            return None
        count = self.held[0]
        wide, widths = np.zeros((count, 4)), np.zeros(count, dtype=np.int64)
        first = 0
        for size, piece in zip(self.sizes, self.beyond, strict=True):
            if piece is not None:
                wide[first : first + size], widths[first : first + size] = piece
            first += size
        seven = widths >= 7
        weighted = bool((wide[seven, 0] == 1).all())
        colours = np.where((seven if weighted else np.zeros(count, bool))[:, None], np.roll(wide, -1, axis=1), wide)
        colours[~seven | weighted, 3] = 1.0
        colours[widths < 6] = np.nan
        largest = np.nanmax(colours[:, :3], initial=0.0)
        # Programs write sRGB-encoded fractions, or bytes. A fraction may exceed 1 by its rounding.
        if largest > _LARGEST_FRACTION:
            colours[:, :3] /= 255
            colours[:, 3] = np.where(colours[:, 3] > _LARGEST_FRACTION, colours[:, 3] / 255, colours[:, 3])
        result: Float64 = np.nan_to_num(np.clip(colours, 0.0, 1.0), nan=1.0)
        return result


# Colours whose largest value is above this are bytes.
_LARGEST_FRACTION = 1.5


def _joined(pieces: list[Array], empty: tuple[int, ...], dtype: type) -> Array:
    """Returns the arrays of all pieces as one, and empties the list."""
    result = np.concatenate(pieces) if pieces else np.zeros(empty, dtype=dtype)
    pieces.clear()
    return result


def _decoded(text: bytes) -> str:
    """Returns a text in UTF-8, or else in Latin-1."""
    try:
        return text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1")


def _shown(word: bytes) -> str:
    return printable(word[:40].decode("latin-1"))


class _Piece:
    """A piece of text, with the lines and words in it.

    array: (B,) its bytes, in which the first words of _WORDS and comments after numbers are replaced by spaces.
    kinds: (L,) the kind of each line.
    words: (L,) the number of words of each line.
    numbers: (L,) the number of each line in the file.
    """

    def __init__(self, text: bytes, first_line: int) -> None:
        """text: the bytes, with a line end as the last."""
        self._text = text
        if b"\\" in text:
            # A backslash at the end of a line joins it with the next one. The length stays, and so do the numbers of lines.
            joined = re.sub(rb"\\\r?\n", lambda match: b" " * len(match[0]), text)
            self._text = joined if joined.endswith(b"\n") else joined[:-1] + b"\n"
        array = np.frombuffer(bytearray(self._text), dtype=np.uint8)
        self.array = array
        self._ends = np.flatnonzero(array == 10)
        self._starts = np.concatenate([[0], self._ends[:-1] + 1])
        written = self._ends if self._text is text else np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == 10)
        self.numbers = first_line + np.searchsorted(written, self._starts)
        self._find_words()
        self._classify()
        if self._blank_comments():
            self._find_words()
        array[self._first[self.kinds < _OTHER]] = 32
        array[self._first[(self.kinds == VT) | (self.kinds == VN)] + 1] = 32

    def number(self, line: int) -> int:
        """Returns the number of a line in the file, for messages."""
        return int(self.numbers[line])

    def _find_words(self) -> None:
        space = np.empty(len(self.array) + 1, dtype=bool)
        space[0] = True
        np.less(self.array - np.uint8(9), 5, out=space[1:])  # \t, \n, \v, \f and \r; smaller bytes wrap round
        space[1:] |= self.array == 32
        change = np.flatnonzero(space[1:] != space[:-1])
        self._word_starts, self._word_ends = change[::2], change[1::2]
        before = np.searchsorted(self._word_starts, self._starts)
        self._first_word = before
        self.words = np.diff(np.append(before, len(self._word_starts)))

    def _classify(self) -> None:
        filled = np.flatnonzero(self.words)
        self.kinds = np.full(len(self.words), _NOTHING, dtype=np.int8)
        self._first = np.zeros(len(self.words), dtype=np.int64)
        word = self._first_word[filled]
        start, length = self._word_starts[word], self._word_ends[word] - self._word_starts[word]
        self._first[filled] = start
        head, second = self.array[start], self.array[start + 1]
        kinds = np.where(np.isin(head, _HEADS), _OTHER, _NOTHING).astype(np.int8)
        for kind, name in enumerate(_WORDS):
            alike = (length == len(name)) & (head == name[0])
            kinds[alike & (second == name[1]) if len(name) == 2 else alike] = kind
        self.kinds[filled] = kinds

    def _blank_comments(self) -> bool:
        """Replaces comments after numbers and corners by spaces, and returns whether there were any."""
        hashes = np.flatnonzero(self.array == ord("#"))
        if not len(hashes):
            return False
        line = np.searchsorted(self._ends, hashes)
        # Microsoft's C library writes numbers such as "-1.#IND".
        inside = (self.kinds[line] < _OTHER) & (self.array[hashes - 1] != ord("."))
        hashes, line = hashes[inside], line[inside]
        if not len(hashes):
            return False
        line, first = np.unique(line, return_index=True)
        change = np.zeros(len(self.array), dtype=np.int8)
        change[hashes[first]] = 1
        change[self._ends[line]] = -1
        self.array[np.cumsum(change, dtype=np.int8) > 0] = 32
        return True

    def bytes_of(self, lines: Int64) -> bytes:
        """Returns the text of lines (n,), in ascending order, without their first words."""
        if len(lines) == len(self.words):
            return self.array.tobytes()
        chosen = np.zeros(len(self.words), dtype=bool)
        chosen[lines] = True
        text: bytes = self.array[np.repeat(chosen, self._ends - self._starts + 1)].tobytes()
        return text

    def bytes_between(self, starts: Int64, ends: Int64) -> bytes:
        """Returns the text of words, each with the space that follows it."""
        change = np.zeros(len(self.array) + 1, dtype=np.int8)
        change[starts] += 1
        change[ends + 1] -= 1
        result: bytes = self.array[np.cumsum(change[:-1], dtype=np.int8) > 0].tobytes()
        return result

    def words_of(self, lines: Int64) -> tuple[Int64, Int64]:
        """Returns the starts and ends (C,) of all words of lines (n,) but the first."""
        chosen = np.zeros(len(self.words), dtype=bool)
        chosen[lines] = True
        words = np.repeat(chosen, self.words)
        words[self._first_word[lines]] = False
        return self._word_starts[words], self._word_ends[words]

    def others(self) -> Iterator[tuple[int, str, str]]:
        """Yields the number of the line, the first word and the rest of each line that is neither numbers nor corners."""
        for line in np.flatnonzero(self.kinds == _OTHER).tolist():
            word, *rest = self._text[self._starts[line] : self._ends[line]].split(None, 1)
            yield self.number(line), word.decode("latin-1"), " ".join(_decoded(rest[0]).split()) if rest else ""
