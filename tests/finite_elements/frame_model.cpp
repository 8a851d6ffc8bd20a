#include "finite_elements/frame_model.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <atomic>
#include <bit>
#include <cstdint>
#include <fstream>

namespace grapnel::testing {

using Eigen::MatrixXd;
using Eigen::Vector3d;

FrameModel::FrameModel(std::vector<Vector3d> places) : nodes(std::move(places)) {
  const auto n = static_cast<Eigen::Index>(6 * nodes.size());
  M = MatrixXd::Zero(n, n), K = M;
}

// Przemieniecki, Theory of Matrix Structural Analysis (1968): slender beams.
void FrameModel::add_beam(int a, int b, const FrameSection& s) {
  const Vector3d along = nodes[static_cast<std::size_t>(b)] - nodes[static_cast<std::size_t>(a)];
  const double L = along.norm();
  MatrixXd k = MatrixXd::Zero(12, 12), m = k;
  const auto put = [](MatrixXd& A, int i, int j, double value) { A(i, j) = A(j, i) = value; };
  const auto bar = [&](int i, double stiffness, double mass) {
    put(k, i, i, stiffness / L), put(k, i + 6, i + 6, stiffness / L), put(k, i, i + 6, -stiffness / L);
    put(m, i, i, mass * L / 3), put(m, i + 6, i + 6, mass * L / 3), put(m, i, i + 6, mass * L / 6);
  };
  bar(0, s.EA, s.mass_per_length);
  bar(3, s.GJ, s.polar);
  // Deflection w whose slope is `sign` times the rotation.
  const auto bending = [&](int w, int turn, double EI, double sign) {
    const int at[4] = {w, turn, w + 6, turn + 6};
    const double one[4] = {1, sign * L, 1, sign * L};
    const double stiff[4][4] = {{12, 6, -12, 6}, {6, 4, -6, 2}, {-12, -6, 12, -6}, {6, 2, -6, 4}};
    const double heavy[4][4] = {{156, 22, 54, -13}, {22, 4, 13, -3}, {54, 13, 156, -22}, {-13, -3, -22, 4}};
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        k(at[i], at[j]) = EI / (L * L * L) * stiff[i][j] * one[i] * one[j];
        m(at[i], at[j]) = s.mass_per_length * L / 420 * heavy[i][j] * one[i] * one[j];
      }
    }
  };
  bending(1, 5, s.EIz, 1);
  bending(2, 4, s.EIy, -1);
  const Vector3d x = along / L;
  const Vector3d y = (std::abs(x[2]) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX()).cross(x).normalized();
  Eigen::Matrix3d R;  // rows: axes of the beam
  R.row(0) = x, R.row(1) = y, R.row(2) = x.cross(y);
  MatrixXd T = MatrixXd::Zero(12, 12);
  for (int i = 0; i < 4; ++i) T.block<3, 3>(3 * i, 3 * i) = R;
  k = T.transpose() * k * T, m = T.transpose() * m * T;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      const int r = 6 * (i < 6 ? a : b) + i % 6, c = 6 * (j < 6 ? a : b) + j % 6;
      K(r, c) += k(i, j), M(r, c) += m(i, j);
    }
  }
}

namespace {

std::vector<ElementDof> dofs_of(const MatrixXd& A) {
  std::vector<ElementDof> dofs;
  for (int i = 0; i < A.rows(); ++i) dofs.push_back({101 + i / 6, i % 6 + 1});
  return dofs;
}

}  // namespace

ElementMatrix FrameModel::mass() const { return {"mass", M.sparseView(), dofs_of(M)}; }
ElementMatrix FrameModel::stiffness() const { return {"stiffness", K.sparseView(), dofs_of(K)}; }

FrameModel straight_beam(double length, int elements, const FrameSection& section) {
  std::vector<Vector3d> places;
  for (int i = 0; i <= elements; ++i) places.emplace_back(length * i / elements, 0, 0);
  FrameModel model(places);
  for (int i = 0; i < elements; ++i) model.add_beam(i, i + 1, section);
  return model;
}

FrameModel bent_mast(int elements) {
  std::vector<Vector3d> places;
  for (int i = 0; i <= elements; ++i) places.emplace_back(2.5 * i / elements, 0, 0);
  for (int i = 1; i <= elements; ++i) places.emplace_back(2.5, 1.2 * i / elements, 0.7 * i / elements);
  FrameModel model(places);
  FrameSection arm;
  arm.EIy = 250, arm.EIz = 500, arm.GJ = 100, arm.mass_per_length = 1.5;
  for (int i = 0; i < 2 * elements; ++i) model.add_beam(i, i + 1, i < elements ? FrameSection() : arm);
  return model;
}

TemporaryFolder::TemporaryFolder() {
  static std::atomic<int> count = 0;
  path_ = std::filesystem::temp_directory_path() / fmt::format("grapnel-finite-elements-{}-{}", getpid(), count++);
  std::filesystem::create_directories(path_);
}
TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void write_text(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

std::string matrix_market_list(const MatrixXd& A) {
  std::string entries;
  int count = 0;
  for (int c = 0; c < A.cols(); ++c) {
    for (int r = c; r < A.rows(); ++r) {
      if (A(r, c) != 0) entries += fmt::format("{} {} {}\n", r + 1, c + 1, A(r, c)), ++count;
    }
  }
  return fmt::format("%%MatrixMarket matrix coordinate real symmetric\n% a comment\n{} {} {}\n", A.rows(), A.cols(),
                     count) +
         entries;
}

std::string matrix_market_array(const MatrixXd& A) {
  std::string text = fmt::format("%%MatrixMarket matrix array real general\n{} {}\n", A.rows(), A.cols());
  for (int c = 0; c < A.cols(); ++c) {
    for (int r = 0; r < A.rows(); ++r) text += fmt::format("{}\n", A(r, c));
  }
  return text;
}

std::string table(const MatrixXd& A) {
  std::string text = "# mass or stiffness\n";
  for (int r = 0; r < A.rows(); ++r) {
    for (int c = 0; c < A.cols(); ++c) text += fmt::format("{}{}", c == 0 ? "" : ", ", A(r, c));
    text += "\r\n";
  }
  return text;
}

std::string calculix(const MatrixXd& A) {
  std::string text;
  for (int c = 0; c < A.cols(); ++c) {
    for (int r = 0; r <= c; ++r) text += fmt::format("{} {} {:.16e}\n", r + 1, c + 1, A(r, c));
  }
  return text;
}

std::string calculix_dofs(const MatrixXd& A) {
  std::string text;
  for (const ElementDof& dof : dofs_of(A)) text += fmt::format("{}.{}\n", dof.node, dof.component);
  return text;
}

std::string dmig(const std::string& name, const MatrixXd& A, DmigFields fields) {
  const std::vector<ElementDof> dofs = dofs_of(A);
  std::string text = "$ made by a test\n";
  text += fields == DmigFields::wide ? fmt::format("DMIG    {:8}       0       6       2       0\n", name)
                                     : fmt::format("DMIG,{},0,6,2,0\n", name);
  for (std::size_t c = 0; c < dofs.size(); ++c) {
    std::string rows;
    for (std::size_t r = c; r < dofs.size(); ++r) {
      const double value = A(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
      if (value == 0) continue;
      if (fields == DmigFields::wide) {
        std::string number = fmt::format("{:.9E}", value);  // 16 characters, with Fortran's D
        number[number.find('E')] = 'D';
        rows += fmt::format("*       {:>16}{:>16}{:>16}\n", dofs[r].node, dofs[r].component, number);
      } else {
        rows += fmt::format(",{},{},{},", dofs[r].node, dofs[r].component, value);
        if ((r - c) % 2 == 1) rows += "\n+";
      }
    }
    if (rows.empty()) continue;
    if (fields == DmigFields::wide) {
      text += fmt::format("DMIG*   {:16}{:>16}{:>16}{:16}*\n{}", name, dofs[c].node, dofs[c].component, "", rows);
    } else {
      // One entry per line, its first row in the fields after the column.
      for (std::size_t r = c; r < dofs.size(); ++r) {
        const double value = A(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
        if (value != 0)
          text += fmt::format("DMIG,{},{},{},,{},{},{}\n", name, dofs[c].node, dofs[c].component, dofs[r].node,
                              dofs[r].component, value);
      }
    }
  }
  return text;
}

std::string output4(const std::string& name, const MatrixXd& A, Output4Layout layout) {
  const auto n = static_cast<int>(A.rows());
  std::string text =
      fmt::format("{:8}{:8}{:8}{:8}{:8}1P,3E24.16\n", n, layout == Output4Layout::wide_strings ? -n : n, 6, 2, name);
  const auto numbers = [&](int c, int begin, int end) {
    for (int r = begin; r < end; ++r)
      text += fmt::format("{:24.16E}{}", A(r, c), (r - begin) % 3 == 2 || r + 1 == end ? "\n" : "");
  };
  for (int c = 0; c < n; ++c) {
    if (layout == Output4Layout::dense) {
      int begin = 0, end = n;
      while (begin < end && A(begin, c) == 0) ++begin;
      while (end > begin && A(end - 1, c) == 0) --end;
      if (begin == end) continue;
      text += fmt::format("{:8}{:8}{:8}\n", c + 1, begin + 1, end - begin);
      numbers(c, begin, end);
      continue;
    }
    std::vector<std::pair<int, int>> strings;  // of nonzero numbers
    for (int r = 0; r < n; ++r) {
      if (A(r, c) == 0) continue;
      if (strings.empty() || strings.back().second != r) strings.emplace_back(r, r);
      strings.back().second = r + 1;
    }
    const bool wide = layout == Output4Layout::wide_strings;
    int words = 0;
    for (const auto& [begin, end] : strings) words += 2 * (end - begin) + (wide ? 2 : 1);
    if (words == 0) continue;
    text += fmt::format("{:8}{:8}{:8}\n", c + 1, 0, words);
    for (const auto& [begin, end] : strings) {
      const int length = 2 * (end - begin);
      text += wide ? fmt::format("{:8}{:8}\n", length + 1, begin + 1)
                   : fmt::format("{:12}\n", (begin + 1) + 65536 * (length + 1));
      numbers(c, begin, end);
    }
  }
  return text + fmt::format("{:8}{:8}{:8}\n{:24.16E}\n", n + 1, 1, 1, 1.0);
}

std::string abaqus_coordinates(const MatrixXd& A) {
  std::string text;
  for (int c = 0; c < A.cols(); ++c) {
    for (int r = 0; r < A.rows(); ++r) {
      if (A(r, c) != 0) text += fmt::format("{}  {}  {:.15e}\n", r + 1, c + 1, A(r, c));
    }
  }
  return text;
}

std::string abaqus_labels(const MatrixXd& A) {
  const std::vector<ElementDof> dofs = dofs_of(A);
  std::string text = "**\n*MATRIX INPUT, NAME=K\n";
  for (std::size_t c = 0; c < dofs.size(); ++c) {
    for (std::size_t r = c; r < dofs.size(); ++r) {
      const double value = A(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
      if (value != 0)
        text += fmt::format("{},{}, {},{}, {:.15e}\n", dofs[r].node, dofs[r].component, dofs[c].node, dofs[c].component,
                            value);
    }
  }
  return text;
}

namespace {

class Output4Writer {
 public:
  explicit Output4Writer(const Output4Bytes& form) : form_(form) {}

  static void put(std::string& to, std::uint64_t value, int size, bool is_big_endian) {
    for (int k = 0; k < size; ++k) to += static_cast<char>(value >> 8 * (is_big_endian ? size - 1 - k : k));
  }
  void word(std::string& to, long long value) const {
    put(to, static_cast<std::uint64_t>(value), form_.word, form_.is_big_endian);
  }
  // Words per real number.
  int words() const { return form_.is_single || form_.word == 8 ? 1 : 2; }
  void number(std::string& to, double value) const {
    for (const double part : {value, 1.0}) {
      if (form_.is_single && form_.word == 4)
        put(to, std::bit_cast<std::uint32_t>(static_cast<float>(part)), 4, form_.is_big_endian);
      else
        put(to, std::bit_cast<std::uint64_t>(part), 8, form_.is_big_endian);
      if (!form_.is_complex) return;
    }
  }
  void record(std::string& to, const std::string& content) const {
    for (int k = 0; k < 2; ++k) {
      put(to, content.size(), form_.marker, form_.is_big_endian);
      if (k == 0) to += content;
    }
  }

 private:
  const Output4Bytes& form_;
};

}  // namespace

std::string output4_binary(const std::string& name, const MatrixXd& A, const Output4Bytes& form) {
  const Output4Writer bytes(form);
  const bool wide = form.layout == Output4Layout::wide_strings;
  std::string text, record;
  bytes.word(record, A.cols()), bytes.word(record, wide ? -A.rows() : A.rows());
  bytes.word(record, A.rows() == A.cols() ? 6 : 2), bytes.word(record, (form.is_complex ? 3 : 1) + !form.is_single);
  if (form.word == 4)
    record += fmt::format("{:8}", name);
  else  // four characters per word
    record += fmt::format("{:8}{:8}", name.substr(0, 4), name.size() > 4 ? name.substr(4) : "");
  bytes.record(text, record);
  const int each = bytes.words() * (form.is_complex ? 2 : 1);
  for (int c = 0; c < A.cols(); ++c) {
    std::vector<std::pair<int, int>> strings;
    for (int r = 0; r < A.rows(); ++r) {
      if (A(r, c) == 0) continue;
      if (strings.empty() || (strings.back().second != r && form.layout != Output4Layout::dense))
        strings.emplace_back(r, r);
      strings.back().second = r + 1;
    }
    if (strings.empty()) continue;
    record.clear();
    for (const auto& [begin, end] : strings) {
      const long long length = static_cast<long long>(each) * (end - begin);
      if (wide) bytes.word(record, length + 1), bytes.word(record, begin + 1);
      if (form.layout == Output4Layout::strings) bytes.word(record, begin + 1 + 65536 * (length + 1));
      for (int r = begin; r < end; ++r) bytes.number(record, A(r, c));
    }
    std::string head;
    bytes.word(head, c + 1), bytes.word(head, form.layout == Output4Layout::dense ? strings[0].first + 1 : 0);
    bytes.word(head, static_cast<long long>(record.size()) / form.word);
    bytes.record(text, head + record);
  }
  record.clear();
  bytes.word(record, A.cols() + 1), bytes.word(record, 1), bytes.word(record, bytes.words());
  Output4Bytes real = form;
  real.is_complex = false;
  Output4Writer(real).number(record, 1.4142135623730951);
  bytes.record(text, record);
  return text;
}

}  // namespace grapnel::testing
