// Triangles from STL and OBJ files.
#include "grapnel/scenario/mesh_formats.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "grapnel/text/message_text.hpp"

namespace grapnel::mesh_formats {

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

namespace {

// --- Texts ---

struct Word {
  std::string_view text;
  int line, column;  // from 1 [characters]
};

// A text line by line, its words, and where it is. Lines end with a line feed, a carriage return or both.
class Lines {
 public:
  enum class Continuation { none, backslash };  // whether a trailing backslash continues the line

  Lines(std::string_view text, Continuation continuation)
      : text_(text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text), continuation_(continuation) {}

  // The next line that has words, without what stands behind '#'.
  bool next() {
    while (at_ < text_.size()) {
      words_.clear();
      while (next_part()) {
      }
      if (!words_.empty()) return true;
    }
    return false;
  }
  const std::vector<Word>& words() const { return words_; }
  int number() const { return number_; }

  [[noreturn]] void fail(std::size_t word, const std::string& message) const {
    if (word < words_.size()) throw MeshFault{words_[word].line, words_[word].column, message};
    throw MeshFault{number_, 1, message};
  }

  double coordinate(std::size_t word) const {
    std::string_view text = words_[word].text;
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    // Values below the range of a double become zero; values above it are reported below.
    if (error == std::errc::result_out_of_range && end == text.data() + text.size()) {
      value = text.find("e-") != text.npos || text.find("E-") != text.npos ? 0 : HUGE_VAL;
    } else if (error != std::errc() || end != text.data() + text.size()) {
      fail(word, fmt::format("a coordinate must be a number, not {}", in_quotes(words_[word].text)));
    }
    if (!(std::abs(value) < kLargestCoordinate)) {
      fail(word, fmt::format("a coordinate is {}, must be a finite number below {:.0e}", in_quotes(words_[word].text),
                             kLargestCoordinate));
    }
    return value;
  }
  Vector3d place(std::size_t first) const { return {coordinate(first), coordinate(first + 1), coordinate(first + 2)}; }

 private:
  // Adds the words of the next line of the text; returns whether the line continues.
  bool next_part() {
    const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
    line_ = text_.substr(at_, end - at_);
    at_ = end + (text_.substr(end, 2) == "\r\n" ? 2 : 1);
    ++number_;
    line_ = line_.substr(0, std::min(line_.find('#'), line_.size()));
    const std::size_t last = line_.find_last_not_of(" \t");
    const bool goes_on =
        continuation_ == Continuation::backslash && last != std::string_view::npos && line_[last] == '\\';
    if (goes_on) line_ = line_.substr(0, last);
    split();
    return goes_on && at_ < text_.size();
  }

  void split() {
    int column = 1;
    for (std::size_t i = 0; i < line_.size();) {
      if (is_blank(line_[i])) {
        ++i, ++column;
        continue;
      }
      const std::size_t begin = i;
      const int here = column;
      for (; i < line_.size() && !is_blank(line_[i]); ++i)
        column += (static_cast<unsigned char>(line_[i]) & 0xc0) != 0x80;
      words_.push_back({line_.substr(begin, i - begin), number_, here});
    }
  }
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

  std::string_view text_, line_;
  Continuation continuation_;
  std::size_t at_ = 0;
  int number_ = 0;
  std::vector<Word> words_;
};

// --- STL ---

constexpr std::size_t kStlHeader = 84, kStlFacet = 50;

std::uint32_t little_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int k = 3; k >= 0; --k) value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(k)]);
  return value;
}

void read_binary_stl(std::string_view bytes, MeshCollector& mesh) {
  if (bytes.size() < kStlHeader) {
    throw MeshFault{
        0, 0,
        fmt::format("not an STL file: {} are too few for a binary one, and it is not a text that begins with 'solid'",
                    counted(bytes.size(), "byte"))};
  }
  const std::size_t count = little_endian(bytes, 80);
  if (bytes.size() < kStlHeader + kStlFacet * count) {
    throw MeshFault{
        0, 0,
        fmt::format("a binary STL file of {} triangles has {} bytes, this one {}: it is truncated or not an STL file",
                    count, kStlHeader + kStlFacet * count, bytes.size())};
  }
  check_count(count, 0);
  if (const std::size_t more = bytes.size() - (kStlHeader + kStlFacet * count); more > 0) {
    mesh.warning = fmt::format(
        "{} behind the {} that the binary STL file counts: {}", counted(more, "byte"), counted(count, "triangle"),
        more % kStlFacet == 0 ? "more triangles, if its count is wrong, which are not read" : "not read");
  }
  for (std::size_t f = 0; f < count; ++f) {
    std::array<int, 3> v{};
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3d p;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = kStlHeader + kStlFacet * f + 12 * (k + 1) + 4 * c;
        p[static_cast<int>(c)] = std::bit_cast<float>(little_endian(bytes, at));
        if (!(std::abs(p[static_cast<int>(c)]) < kLargestCoordinate)) {
          throw MeshFault{0, 0,
                          fmt::format("triangle {}: a coordinate is {}, must be a finite number below {:.0e}", f + 1,
                                      p[static_cast<int>(c)], kLargestCoordinate)};
        }
      }
      v[k] = mesh.vertex(p);
    }
    mesh.triangle(v[0], v[1], v[2]);
  }
}

// facet, outer loop, three times vertex, endloop, endfacet: normals are not read, and neither are names.
void read_text_stl(std::string_view bytes, MeshCollector& mesh) {
  static constexpr const char* kExpected[] = {"facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
  Lines lines(bytes, Lines::Continuation::none);
  std::array<int, 3> v{};
  std::size_t step = 0;  // in kExpected
  bool inside = false;   // between solid and endsolid
  while (lines.next()) {
    const std::string word = lower_case(lines.words()[0].text);
    if (!inside) {
      if (word != "solid") lines.fail(0, fmt::format("expected 'solid', not {}", in_quotes(lines.words()[0].text)));
      inside = true;
    } else if (step == 0 && word == "endsolid") {
      inside = false;
    } else if (word != kExpected[step]) {
      lines.fail(0, fmt::format("expected '{}', not {}", kExpected[step], in_quotes(lines.words()[0].text)));
    } else {
      if (word == "vertex") {
        if (lines.words().size() != 4) lines.fail(0, "a vertex must have 3 coordinates");
        v[step - 2] = mesh.vertex(lines.place(1));
      }
      step = (step + 1) % std::size(kExpected);
      if (step == 0) mesh.triangle(v[0], v[1], v[2]);
      check_count(mesh.count(), lines.number());
    }
  }
  if (inside) throw MeshFault{lines.number(), 1, "the file ends without 'endsolid': it is truncated"};
}

// Binary files may begin with "solid" too, but their size is what their count asks for.
bool is_text_stl(std::string_view bytes) {
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  if (bytes.size() >= kStlHeader && bytes.size() == kStlHeader + kStlFacet * std::size_t{little_endian(bytes, 80)}) {
    return false;
  }
  const std::size_t first = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  return lower_case(bytes.substr(first, 5)) == "solid" && bytes.substr(0, 512).find('\0') == bytes.npos;
}

// --- OBJ ---

class ObjReader {
 public:
  ObjReader(std::string_view bytes, MeshCollector& mesh) : lines_(bytes, Lines::Continuation::backslash), mesh_(mesh) {}

  void read() {
    while (lines_.next()) {
      const std::string_view word = lines_.words()[0].text;
      if (word == "v") {
        // A fourth number is a weight, six are a place and a colour.
        if (lines_.words().size() < 4) lines_.fail(0, "a vertex must have 3 coordinates");
        places_.push_back(lines_.place(1));
      } else if (word == "f") {
        read_face();
      }
    }
    for (const Corner& corner : corners_) numbers_.push_back(number_of(corner));
    for (std::size_t f = 0, at = 0; f < faces_.size(); at += faces_[f++]) {
      for (std::size_t k = 2; k < faces_[f]; ++k) {
        mesh_.triangle(numbers_[at], numbers_[at + k - 1], numbers_[at + k]);
      }
    }
  }

 private:
  // A vertex that a face names; it may come later in the file.
  struct Corner {
    long long index;  // from 0
    int line, column;
  };

  void read_face() {
    const std::vector<Word>& words = lines_.words();
    if (words.size() < 4) lines_.fail(0, "a face must have at least 3 vertices");
    triangles_ += words.size() - 3;
    check_count(triangles_, lines_.number());
    for (std::size_t i = 1; i < words.size(); ++i) {
      const std::string_view text = words[i].text.substr(0, std::min(words[i].text.find('/'), words[i].text.size()));
      long long index = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
      if (error != std::errc() || end != text.data() + text.size() || index == 0) {
        lines_.fail(i, fmt::format("a face must name vertices by whole numbers from 1, or below 0 from the last one "
                                   "back, not {}",
                                   in_quotes(words[i].text)));
      }
      const auto count = static_cast<long long>(places_.size());
      if (index < -count) {
        lines_.fail(i, fmt::format("there is no vertex {}: {} are before this line", index, places_.size()));
      }
      corners_.push_back({index > 0 ? index - 1 : count + index, words[i].line, words[i].column});
    }
    faces_.push_back(words.size() - 1);
  }

  int number_of(const Corner& corner) {
    if (corner.index >= static_cast<long long>(places_.size())) {
      throw MeshFault{corner.line, corner.column,
                      fmt::format("there is no vertex {}: the file has {}", corner.index + 1, places_.size())};
    }
    return mesh_.vertex(places_[static_cast<std::size_t>(corner.index)]);
  }

  Lines lines_;
  MeshCollector& mesh_;
  std::vector<Vector3d> places_;
  std::vector<Corner> corners_;     // of all faces in turn
  std::vector<std::size_t> faces_;  // how many corners
  std::vector<int> numbers_;        // of corners, in the mesh
  std::size_t triangles_ = 0;
};

}  // namespace

void read_stl(std::string_view bytes, MeshCollector& mesh) {
  if (is_text_stl(bytes))
    read_text_stl(bytes, mesh);
  else
    read_binary_stl(bytes, mesh);
}

void read_obj(std::string_view bytes, MeshCollector& mesh) { ObjReader(bytes, mesh).read(); }

}  // namespace grapnel::mesh_formats
