// Nastran's OUTPUT4 files, as text and as Fortran's unformatted records.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "grapnel/import/element_text.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::element_text {
namespace {

constexpr long long kMaxOutput4Rows = 100'000'000;

// A matrix's head: columns, rows (negative: strings have two leading numbers), form, type, name, Fortran format.
struct Output4Head {
  int columns = 0, rows = 0;
  bool wide_strings = false;
  long long form = 0, type = 0;
  std::string name;
  int per_line = 5, width = 16;

  bool is_complex() const { return type == 3 || type == 4; }
  bool is_single() const { return type % 2 == 1; }
  bool is_usable() const { return !is_complex() && rows == columns; }
  // False if these are not values of a matrix.
  bool set(long long n_columns, long long n_rows, long long its_form, long long its_type) {
    if (n_columns < 0 || n_columns > kMaxOutput4Rows || n_rows < -kMaxOutput4Rows || n_rows > kMaxOutput4Rows ||
        its_type < 1 || its_type > 4)
      return false;
    columns = static_cast<int>(n_columns), rows = static_cast<int>(std::abs(n_rows));
    wide_strings = n_rows < 0 || rows > 65535;
    form = its_form, type = its_type;
    return true;
  }
  // Rows covered by this count of numbers: a complex one counts twice. Empty if they are outside the matrix.
  std::optional<long long> rows_of(long long first_row, long long count) const {
    const long long covered = is_complex() ? count / 2 : count;
    if (first_row < 1 || count < 0 || (is_complex() && count % 2 != 0) || first_row - 1 + covered > rows)
      return std::nullopt;
    return covered;
  }
  std::string beyond(long long first_row, long long count) const {
    return fmt::format("{} numbers from row {} on are beyond the {} rows of matrix {}", count, first_row, rows, name);
  }
};

// --- Text ---

class Output4TextReader {
 public:
  Output4TextReader(const std::string& path, std::string_view text, FaultList& faults)
      : lines_(path, text), faults_(faults) {}

  // The next matrix's head; empty at the end, and after an error.
  std::optional<Output4Head> head() {
    std::optional<std::string_view> line;
    do line = lines_.next();
    while (line && trimmed(*line).empty());
    if (!line) return std::nullopt;
    Output4Head head;
    const auto columns = integer(*line, 0), rows = integer(*line, 1), form = integer(*line, 2),
               type = integer(*line, 3);
    if (!columns || !rows || !form || !type || !head.set(*columns, *rows, *form, *type)) {
      fault(*line, "the head of a matrix must be columns, rows, form and type, of eight characters each, and its name");
      return std::nullopt;
    }
    head.name = upper(trimmed(line->size() > 32 ? line->substr(32, 8) : std::string_view()));
    std::string format = upper(trimmed(line->size() > 40 ? line->substr(40) : std::string_view()));
    if (format.starts_with("1P,")) format.erase(0, 3);
    if (const std::size_t e = format.find_first_of("ED"); e != std::string::npos && e > 0) {
      const auto per_line = integer_of(std::string_view(format).substr(0, e));
      const std::size_t point = format.find('.', e);
      const auto width = integer_of(std::string_view(format).substr(e + 1, point - e - 1));
      if (!per_line || !width || *per_line < 1 || *per_line > 100 || *width < 8 || *width > 60) {
        fault(*line, fmt::format("cannot read numbers in the format {}", in_quotes(format)));
        return std::nullopt;
      }
      head.per_line = static_cast<int>(*per_line), head.width = static_cast<int>(*width);
    }
    return head;
  }

  // The data after a head: put(row, column, value) for every number of a real matrix. False after an error.
  template <class Put>
  bool columns(const Output4Head& head, Put put) {
    const int words = head.is_single() ? 1 : 2;  // words of a number in strings
    while (true) {
      const auto line = lines_.next();
      const auto column = line ? integer(*line, 0) : std::nullopt, row = line ? integer(*line, 1) : std::nullopt,
                 count = line ? integer(*line, 2) : std::nullopt;
      if (!column || !row || !count || *column < 1 || *count < 0 || *row < 0) {
        fault(line.value_or(std::string_view()),
              "a column must begin with its number, its first row and the count of what follows");
        return false;
      }
      if (*column > head.columns) return lines_.next().has_value() || true;  // the end, followed by one number
      if (*row > 0) {
        if (!numbers(head, *row, *count, [&](int r, double v) { put(r, static_cast<int>(*column) - 1, v); }))
          return false;
        continue;
      }
      for (long long left = *count; left > 0;) {
        const auto string_head = lines_.next();
        // The only number of a short head may be longer than a field.
        const auto first = !string_head        ? std::nullopt
                           : head.wide_strings ? integer(*string_head, 0)
                                               : integer_of(trimmed(*string_head));
        const auto second = string_head && head.wide_strings ? integer(*string_head, 1) : std::optional<long long>(0);
        if (!first || !second || *first < 1) {
          fault(string_head.value_or(std::string_view()),
                "a string of numbers must begin with its length and its first row");
          return false;
        }
        const long long length = head.wide_strings ? *first - 1 : (*first >> 16) - 1;
        const long long first_row = head.wide_strings ? *second : *first & 65535;
        left -= length + (head.wide_strings ? 2 : 1);
        if (!numbers(head, first_row, length / words,
                     [&](int r, double v) { put(r, static_cast<int>(*column) - 1, v); }))
          return false;
      }
    }
  }

  std::optional<long long> integer(std::string_view line, std::size_t field) const {
    return 8 * field < line.size() ? integer_of(trimmed(line.substr(8 * field, 8))) : std::nullopt;
  }

 private:
  void fault(std::string_view part, std::string message) { faults_.add(lines_.mark(part), std::move(message)); }

  template <class Put>
  bool numbers(const Output4Head& head, long long first_row, long long count, Put put) {
    if (!head.rows_of(first_row, count)) {
      fault({}, head.beyond(first_row, count));
      return false;
    }
    std::string_view line;
    const auto width = static_cast<std::size_t>(head.width);
    for (long long i = 0; i < count; ++i) {
      const std::size_t at = static_cast<std::size_t>(i % head.per_line) * width;
      if (at == 0) line = lines_.next().value_or(std::string_view());
      const std::string_view word = at < line.size() ? trimmed(line.substr(at, width)) : std::string_view();
      const auto value = number_of(word);
      if (!value) {
        fault(line, fmt::format("number {} of this column, {}, is not a finite number", i + 1, in_quotes(word)));
        return false;
      }
      if (!head.is_complex()) put(static_cast<int>(first_row - 1 + i), *value);
    }
    return true;
  }

  Lines lines_;
  FaultList& faults_;
};

// --- Binary ---

// The layout of a file's records: the length before and after each, the words in it, and the byte order.
struct Output4Layout {
  std::size_t marker = 4, word = 4;  // [bytes]
  bool is_big_endian = false;

  std::uint64_t unsigned_at(std::string_view bytes, std::size_t at, std::size_t size) const {
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < size; ++k)
      value = value << 8 | static_cast<unsigned char>(bytes[at + (is_big_endian ? k : size - 1 - k)]);
    return value;
  }
  long long integer_at(std::string_view bytes, std::size_t at, std::size_t size) const {
    const std::uint64_t value = unsigned_at(bytes, at, size);
    return size == 4 ? static_cast<std::int32_t>(static_cast<std::uint32_t>(value)) : static_cast<long long>(value);
  }
};

// The first record has four integers and the name, which has two words: 24 or 48 bytes.
std::optional<Output4Layout> output4_layout(std::string_view bytes) {
  for (const std::size_t marker : {4u, 8u}) {
    for (const bool is_big_endian : {false, true}) {
      for (const std::size_t word : {4u, 8u}) {
        const Output4Layout layout{marker, word, is_big_endian};
        const std::size_t length = 6 * word;
        if (bytes.size() >= 2 * marker + length && layout.unsigned_at(bytes, 0, marker) == length &&
            layout.unsigned_at(bytes, marker + length, marker) == length)
          return layout;
      }
    }
  }
  return std::nullopt;
}

class Output4BinaryReader {
 public:
  Output4BinaryReader(const std::string& path, std::string_view bytes, const Output4Layout& layout, FaultList& faults)
      : path_(path), bytes_(bytes), layout_(layout), faults_(faults) {}

  std::optional<Output4Head> head() {
    // Some programs fill the last block with zeros.
    if (bytes_.find_first_not_of('\0', at_) == std::string_view::npos) return std::nullopt;
    const auto record = next_record();
    if (!record) return std::nullopt;
    Output4Head head;
    const std::size_t w = layout_.word;
    if (record->size() != 6 * w ||
        !head.set(integer(*record, 0), integer(*record, 1), integer(*record, 2), integer(*record, 3))) {
      fault("the head of a matrix must be columns, rows, form and type, and its name");
      return std::nullopt;
    }
    for (const char c : record->substr(4 * w)) {
      if (c != '\0' && c != ' ') head.name += c;
    }
    head.name = upper(head.name);
    return head;
  }

  template <class Put>
  bool columns(const Output4Head& head, Put put) {
    const std::size_t w = layout_.word;
    while (true) {
      const auto record = next_record();
      if (!record) return false;
      if (record->size() < 3 * w) return fault("a column must begin with its number, its first row and its length");
      const long long column = integer(*record, 0), row = integer(*record, 1), words = integer(*record, 2);
      if (column > head.columns) return true;  // the end, followed by one number
      if (column < 1 || row < 0 || words < 0 || static_cast<std::uint64_t>(words) > (record->size() - 3 * w) / w)
        return fault(fmt::format("column {} from row {} on has {} words in a record of {} bytes", column, row, words,
                                 record->size()));
      const std::string_view content = record->substr(3 * w, static_cast<std::size_t>(words) * w);
      const auto put_row = [&](int r, double value) { put(r, static_cast<int>(column) - 1, value); };
      if (row > 0 ? !numbers(head, row, content, put_row) : !strings(head, content, put_row)) return false;
    }
  }

 private:
  bool fault(const std::string& message) {
    faults_.add(file_mark(path_), fmt::format("byte {}: {}", begin_ + 1, message));
    return false;
  }
  long long integer(std::string_view record, std::size_t k) const {
    return layout_.integer_at(record, k * layout_.word, layout_.word);
  }

  std::optional<std::string_view> next_record() {
    begin_ = at_;
    const std::size_t m = layout_.marker, left = bytes_.size() - at_;
    const std::uint64_t length = left >= m ? layout_.unsigned_at(bytes_, at_, m) : 0;
    if (left < 2 * m || length > left - 2 * m) {
      fault("the file is truncated: its last record is incomplete");
      return std::nullopt;
    }
    const std::string_view record = bytes_.substr(at_ + m, static_cast<std::size_t>(length));
    if (layout_.unsigned_at(bytes_, at_ + m + record.size(), m) != length) {
      fault(fmt::format("a record of {} bytes is followed by a different length", length));
      return std::nullopt;
    }
    at_ += 2 * m + record.size();
    return record;
  }

  template <class Put>
  bool strings(const Output4Head& head, std::string_view content, Put put) {
    const std::size_t w = layout_.word;
    while (!content.empty()) {
      const std::size_t before = head.wide_strings ? 2 * w : w;
      if (content.size() < before) return fault("a string of numbers must begin with its length and its first row");
      const long long first = integer(content, 0);
      const long long length = (head.wide_strings ? first : first >> 16) - 1;  // [words]
      const long long row = head.wide_strings ? integer(content, 1) : first & 65535;
      content.remove_prefix(before);
      if (length < 1 || static_cast<std::uint64_t>(length) > content.size() / w)
        return fault(fmt::format("a string of {} words is longer than its column", length));
      const std::size_t size = static_cast<std::size_t>(length) * w;
      if (!numbers(head, row, content.substr(0, size), put)) return false;
      content.remove_prefix(size);
    }
    return true;
  }

  template <class Put>
  bool numbers(const Output4Head& head, long long first_row, std::string_view content, Put put) {
    // With words of eight bytes, single precision also has eight bytes.
    const std::size_t size = head.is_single() ? layout_.word : 8;
    const auto count = static_cast<long long>(content.size() / size);
    if (content.size() % size != 0 || !head.rows_of(first_row, count)) return fault(head.beyond(first_row, count));
    if (head.is_complex()) return true;
    for (long long i = 0; i < count; ++i) {
      const std::uint64_t bits = layout_.unsigned_at(content, static_cast<std::size_t>(i) * size, size);
      const double value =
          size == 8 ? std::bit_cast<double>(bits) : std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      if (!std::isfinite(value))
        return fault(
            fmt::format("row {} of matrix {} is {}, which is not a finite number", first_row + i, head.name, value));
      put(static_cast<int>(first_row - 1 + i), value);
    }
    return true;
  }

  const std::string& path_;
  std::string_view bytes_;
  Output4Layout layout_;
  FaultList& faults_;
  std::size_t at_ = 0, begin_ = 0;  // of the next and the current record
};

// `reader()` creates a reader that begins at the first matrix.
template <class MakeReader>
std::optional<ElementMatrix> read_output4_with(MakeReader reader, const std::string& path, const Wanted& wanted,
                                               FaultList& faults) {
  std::vector<NamedMatrix> matrices;
  const std::size_t before = faults.size();
  {
    auto all = reader();
    while (const auto head = all.head()) {
      matrices.push_back({head->name, head->is_usable()});
      if (!all.columns(*head, [](int, int, double) {})) return std::nullopt;
    }
  }
  if (faults.size() > before) return std::nullopt;
  const std::string name = chosen(matrices, wanted, path, "OUTPUT4", faults);
  if (name.empty()) return std::nullopt;
  auto one = reader();
  while (const auto head = one.head()) {
    if (head->name != name) {
      if (!one.columns(*head, [](int, int, double) {})) return std::nullopt;
      continue;
    }
    if (head->columns != head->rows || head->rows < 1 || head->rows > kMaxRows) {
      faults.add(file_mark(path), fmt::format("matrix {} must be square, with 1 to {} rows, not {} by {}", name,
                                              kMaxRows, head->rows, head->columns));
      return std::nullopt;
    }
    if (head->is_complex()) {
      faults.add(file_mark(path),
                 fmt::format("matrix {} must be real (type 1 or 2), not complex (type {})", name, head->type));
      return std::nullopt;
    }
    Entries entries(head->rows, head->is_single() ? Entries::kSingleRounding : Entries::kRounding);
    if (!one.columns(*head, [&](int row, int column, double value) { entries.add(row, column, value); }))
      return std::nullopt;
    auto A = entries.symmetric(head->form == 6 ? Entries::Triangles::one : Entries::Triangles::both, file_mark(path),
                               row_number, faults);
    if (!A) return std::nullopt;
    return ElementMatrix{fmt::format("{}, matrix {}", path, name), std::move(*A), {}};
  }
  return std::nullopt;
}

}  // namespace

std::optional<ElementMatrix> read_output4(const std::string& path, std::string_view bytes, const Wanted& wanted,
                                          FaultList& faults) {
  if (const auto layout = output4_layout(bytes))
    return read_output4_with([&] { return Output4BinaryReader(path, bytes, *layout, faults); }, path, wanted, faults);
  if (bytes.substr(0, 64).find('\0') != std::string_view::npos) {
    faults.add(file_mark(path),
               "the file is neither OUTPUT4 text nor Fortran records, the first of which must have 24 or 48 bytes");
    return std::nullopt;
  }
  return read_output4_with([&] { return Output4TextReader(path, bytes, faults); }, path, wanted, faults);
}

}  // namespace grapnel::element_text
