/// Matrix files: every format gives the same matrix, and what is damaged is said with its place.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "finite_elements/frame_model.hpp"

namespace grapnel::testing {
namespace element_matrix_test {

using ::testing::HasSubstr;

ElementMatrix read(const std::filesystem::path& path, const std::string& name = {}, char initial = 'K') {
  FaultList faults;
  auto matrix = read_element_matrix(path, name, initial, faults);
  for (const Fault& fault : faults.all()) ADD_FAILURE() << fault.text();
  return matrix.value_or(ElementMatrix());
}

void expect_equal(const ElementMatrix& read, const Eigen::MatrixXd& A, double tolerance, bool is_named) {
  ASSERT_EQ(read.size(), A.rows());
  EXPECT_LE((Eigen::MatrixXd(read.A) - A).cwiseAbs().maxCoeff(), tolerance * A.cwiseAbs().maxCoeff());
  ASSERT_EQ(read.dofs.size(), is_named ? static_cast<std::size_t>(A.rows()) : 0u);
  if (is_named) {
    EXPECT_EQ(read.dofs[8], (ElementDof{102, 3}));
  }
}

// In the order of their names, as align() has them.
ElementMatrix sorted(ElementMatrix m) {
  ElementMatrix same = m;
  FaultList faults;
  EXPECT_TRUE(align(m, same, faults));
  return m;
}

TEST(ElementMatrixFiles, AllFormatsAgree) {
  const FrameModel model = bent_mast(2);
  const Eigen::MatrixXd K = 0.5 * (model.K + model.K.transpose()), M = 0.5 * (model.M + model.M.transpose());
  TemporaryFolder folder;
  write_text(folder / "list.mtx", matrix_market_list(K));
  write_text(folder / "array.mtx", matrix_market_array(K));
  write_text(folder / "table.csv", table(K));
  write_text(folder / "job.sti", calculix(K));
  write_text(folder / "job.mas", calculix(M));
  write_text(folder / "job.dof", calculix_dofs(K));
  write_text(folder / "wide.pch", dmig("KAAX", K, DmigFields::wide) + dmig("MAAX", M, DmigFields::wide));
  write_text(folder / "free.bdf", "CEND\nBEGIN BULK\nGRID,101,,0.,0.,0.\n" + dmig("KAAX", K, DmigFields::free));
  write_text(folder / "dense.op4", output4("KXX", K, Output4Layout::dense) + output4("MXX", M, Output4Layout::dense));
  write_text(folder / "strings.op4", output4("KXX", K, Output4Layout::strings));
  write_text(folder / "wide.op4", output4("KXX", K, Output4Layout::wide_strings));
  write_text(folder / "job_STIF1.mtx", abaqus_coordinates(K));
  write_text(folder / "job_STIF2.mtx", abaqus_labels(K));
  expect_equal(read(folder / "list.mtx"), K, 0, false);
  expect_equal(read(folder / "array.mtx"), K, 0, false);
  expect_equal(read(folder / "table.csv"), K, 0, false);
  expect_equal(read(folder / "job.sti"), K, 1e-15, true);
  expect_equal(read(folder / "job.mas"), M, 1e-15, true);
  expect_equal(sorted(read(folder / "wide.pch")), K, 1e-9, true);
  expect_equal(sorted(read(folder / "wide.pch", "maax")), M, 1e-9, true);
  expect_equal(sorted(read(folder / "wide.pch", "", 'M')), M, 1e-9, true);
  expect_equal(sorted(read(folder / "free.bdf")), K, 0, true);
  expect_equal(read(folder / "dense.op4"), K, 1e-15, false);
  expect_equal(read(folder / "dense.op4", "", 'M'), M, 1e-15, false);
  expect_equal(read(folder / "strings.op4"), K, 1e-15, false);
  expect_equal(read(folder / "wide.op4"), K, 1e-15, false);
  expect_equal(read(folder / "job_STIF1.mtx"), K, 1e-15, false);
  expect_equal(read(folder / "job_STIF2.mtx"), K, 1e-15, true);
}

TEST(ElementMatrixFiles, AllBinaryOutput4LayoutsAgree) {
  const FrameModel model = bent_mast(2);
  const Eigen::MatrixXd K = 0.5 * (model.K + model.K.transpose());
  TemporaryFolder folder;
  for (int form = 0; form < 48; ++form) {
    Output4Bytes bytes;
    bytes.is_big_endian = form % 2 == 1;
    bytes.word = form / 2 % 2 == 0 ? 4 : 8, bytes.marker = form / 4 % 2 == 0 ? 4 : 8;
    bytes.is_single = form / 8 % 2 == 1;
    bytes.layout = std::array{Output4Layout::dense, Output4Layout::strings, Output4Layout::wide_strings}.at(
        static_cast<std::size_t>(form / 16));
    // Single precision has single words, which are as long as all words: a double where they have eight bytes.
    const double tolerance = bytes.is_single && bytes.word == 4 ? 6e-8 : 0;  // measured 3.2e-8
    // A complex and a rectangular matrix before and behind it, with the same initial.
    Output4Bytes complex = bytes;
    complex.is_complex = true;
    write_text(folder / "all.op4", output4_binary("K4XX", K, complex) + output4_binary("KRECT", K.leftCols(5), bytes) +
                                       output4_binary("KAAX", K, bytes) + output4_binary("K5", K, complex));
    SCOPED_TRACE(form);
    expect_equal(read(folder / "all.op4"), K, tolerance, false);
    write_text(folder / "one.op4", output4_binary("STIFNESS", K, bytes));
    expect_equal(read(folder / "one.op4", "stifness"), K, tolerance, false);
  }
}

TEST(ElementMatrixFiles, SelectsRealMatrixBesideComplexOne) {
  const Eigen::MatrixXd K = Eigen::Vector3d(2, 3, 4).asDiagonal();
  TemporaryFolder folder;
  // Two numbers for an entry: one column, dense and in strings.
  const std::string head = fmt::format("{:8}{:8}{:8}{:8}{:8}1P,3E24.16\n", 3, 3, 6, 4, "KC");
  const std::string six =
      fmt::format("{:24.16E}{:24.16E}{:24.16E}\n{:24.16E}{:24.16E}{:24.16E}\n", 1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
  const std::string end = fmt::format("{:8}{:8}{:8}\n{:24.16E}\n", 4, 1, 1, 1.0);
  const std::string dense = head + fmt::format("{:8}{:8}{:8}\n", 2, 1, 6) + six + end;
  const std::string strings = head + fmt::format("{:8}{:8}{:8}\n{:12}\n", 2, 0, 13, 1 + 65536 * 13) + six + end;
  for (const std::string& other : {dense, strings}) {
    write_text(folder / "k.op4", other + output4("KAAX", K, Output4Layout::strings));
    EXPECT_EQ(Eigen::MatrixXd(read(folder / "k.op4").A), K);
  }
  write_text(folder / "k.pch",
             "DMIG,KC,0,6,3,0\nDMIG,KC,1,1,,1,1,1.0,2.0\nDMIG,KR,0,9,2,0,,,2\n" + dmig("KAAX", K, DmigFields::free));
  EXPECT_EQ(Eigen::MatrixXd(read(folder / "k.pch").A), K);
  FaultList faults;
  EXPECT_FALSE(read_element_matrix(folder / "k.pch", "KC", 'K', faults));
  EXPECT_THAT(faults.all().back().message, HasSubstr("must be real"));
}

// What a condensation leaves of a determinate interface's stiffness is rounding of the entries that it was made of.
TEST(ElementMatrixFiles, SymmetryTolerance) {
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(7, 7);
  K(6, 6) = 88.8, K(0, 0) = 2e-13, K(0, 1) = 7e-14, K(1, 0) = 1.1e-13;
  Eigen::MatrixXd wrong = K;
  wrong(0, 1) = 1e-9;
  TemporaryFolder folder;
  Output4Bytes binary;
  const auto square = [](std::string text) {  // form 1: both triangles are there
    return text.replace(16, 8, "       1");
  };
  const auto check = [&](const Eigen::MatrixXd& A, bool is_symmetric) {
    write_text(folder / "a.mtx", matrix_market_array(A));
    write_text(folder / "b.mtx", abaqus_coordinates(A));
    write_text(folder / "c.csv", table(A));
    write_text(folder / "d.op4", square(output4("KXX", A, Output4Layout::dense)));
    std::string bytes = output4_binary("KXX", A, binary);
    bytes[4 + 8] = 1;
    write_text(folder / "e.op4", bytes);
    std::string full;
    for (int r = 0; r < 7; ++r) {
      for (int c = 0; c < 7; ++c) full += fmt::format("DMIG,K,{},0,,{},0,{}\n", c + 1, r + 1, A(r, c));
    }
    write_text(folder / "f.pch", "DMIG,K,0,1,2,0\n" + full);
    for (const char* name : {"a.mtx", "b.mtx", "c.csv", "d.op4", "e.op4", "f.pch"}) {
      FaultList faults;
      const auto read = read_element_matrix(folder / name, "", 'K', faults);
      ASSERT_EQ(read.has_value(), is_symmetric) << name;
      if (read) {
        EXPECT_EQ(read->A.coeff(0, 1), read->A.coeff(1, 0)) << name;
      } else {
        EXPECT_THAT(faults.all()[0].message, HasSubstr("not symmetric")) << name;
      }
    }
  };
  check(K, true);
  check(wrong, false);
}

TEST(ElementMatrixFiles, NamesFromFileBesideMatrix) {
  const FrameModel model = bent_mast(2);
  const Eigen::MatrixXd K = 0.5 * (model.K + model.K.transpose());
  TemporaryFolder folder;
  write_text(folder / "k.mtx", matrix_market_list(K));
  write_text(folder / "k.op4", output4("KXX", K, Output4Layout::dense));
  write_text(folder / "k.csv", table(K));
  write_text(folder / "k.dof", calculix_dofs(K));
  for (const char* name : {"k.mtx", "k.op4", "k.csv"}) expect_equal(read(folder / name), K, 1e-15, true);
  // Other forms of the same.
  static constexpr const char* kNames[] = {"UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"};
  std::string blanks, mapping = "Matrix Eqn  Node  DOF\n";
  for (int row = 0; row < K.rows(); ++row) {
    blanks += fmt::format("{} {}  # a comment\n", 101 + row / 6, row % 6 + 1);
    mapping += fmt::format("{} {} {}\n", row + 1, 101 + row / 6, kNames[row % 6]);
  }
  for (const std::string& text : {blanks, mapping}) {
    write_text(folder / "names.txt", text);
    FaultList faults;
    const auto named = read_element_matrix(folder / "k.mtx", "", 'K', faults, folder / "names.txt");
    ASSERT_TRUE(named) << faults.all()[0].text();
    expect_equal(*named, K, 1e-15, true);
  }
  const auto fault = [&](const std::string& file, const std::string& names) {
    write_text(folder / "names.txt", names);
    FaultList faults;
    EXPECT_FALSE(read_element_matrix(folder / file, "", 'K', faults, folder / "names.txt"));
    return faults.empty() ? std::string() : faults.all()[0].text();
  };
  EXPECT_THAT(fault("k.mtx", "1.1\n1.2\n"), HasSubstr("names 2 rows, and"));
  EXPECT_THAT(fault("k.mtx", "1.1\n1.7\n"), HasSubstr("names.txt:2:1: error: must be NODE.COMPONENT"));
  EXPECT_THAT(fault("k.mtx", "2 1 UX\n"), HasSubstr("must be NODE.COMPONENT"));
  EXPECT_THAT(fault("k.mtx", "\n"), HasSubstr("names no rows"));
  write_text(folder / "k.pch", dmig("KAAX", K, DmigFields::wide));
  EXPECT_THAT(fault("k.pch", blanks), HasSubstr("the file contains the names of its rows"));
}

// Small fields of eight characters, numbers without an E, scalar points, two rows a line.
TEST(ElementMatrixFiles, DmigInSmallFields) {
  TemporaryFolder folder;
  const auto line = [](std::initializer_list<const char*> fields) {
    std::string text;
    for (const char* field : fields) text += fmt::format("{:>8}", field);
    return text + "\n";
  };
  std::string text = line({"DMIG", "STIF", "0", "6", "1", "0"});
  text += line({"DMIG", "STIF", "27", "1", "", "27", "1", "4.5+3", "", "+1"});
  text += line({"+1", "50", "", "-2.5+0", "", "50", "0", "-2.5+0"});
  text += line({"DMIG", "STIF", "50", "", "", "50", "", "7.D+0"});
  for (std::size_t at = text.find("    DMIG"); at != std::string::npos; at = text.find("    DMIG"))
    text.replace(at, 8, "DMIG    ");
  text.replace(text.find("      +1      50"), 8, "+1      ");
  write_text(folder / "small.dat", text);
  const ElementMatrix m = sorted(read(folder / "small.dat"));
  ASSERT_EQ(m.size(), 2);
  EXPECT_EQ(m.dofs[0], (ElementDof{27, 1}));
  EXPECT_EQ(m.dofs[1], (ElementDof{50, 0}));
  EXPECT_EQ(Eigen::MatrixXd(m.A)(0, 0), 4500);
  EXPECT_EQ(Eigen::MatrixXd(m.A)(0, 1), -5);  // entries of one place are added
  EXPECT_EQ(Eigen::MatrixXd(m.A)(1, 1), 7);
}

TEST(ElementMatrixFiles, DamagedFilesReportPosition) {
  TemporaryFolder folder;
  const auto fault = [&](const std::string& name, const std::string& text, const std::string& wanted = {}) {
    write_text(folder / name, text);
    FaultList faults;
    EXPECT_FALSE(read_element_matrix(folder / name, wanted, 'K', faults)) << text;
    if (faults.empty()) return std::string();
    const Fault& f = faults.all()[0];
    return fmt::format("{}:{}:{}: {}", std::filesystem::path(f.file).filename().string(), f.line, f.column, f.message);
  };
  EXPECT_THAT(fault("a.xlsx", ""), HasSubstr("ends in .mtx"));
  const std::string head = "%%MatrixMarket matrix coordinate real symmetric\n";
  EXPECT_THAT(fault("a.mtx", "%MatrixMarket\n"), HasSubstr("a.mtx:1:1: a Matrix Market file begins with"));
  EXPECT_THAT(fault("a.mtx", "1 2\n"), HasSubstr("a.mtx:1:1: a .mtx file is a Matrix Market file"));
  EXPECT_THAT(fault("a.mtx", "1 1 2\n1 0 3\n"), HasSubstr("a.mtx:2:3: a row or column must be from 1"));
  EXPECT_THAT(fault("a.mtx", "1,8,1,8,2.0\n"), HasSubstr("a node and its degree of freedom from 1 to 6"));
  EXPECT_THAT(fault("a.mtx", "1 1 1e36\n"), HasSubstr("with a boundary condition"));
  EXPECT_THAT(fault("a.mtx", "** nothing\n"), HasSubstr("no entries"));
  EXPECT_THAT(fault("a.mtx", "%%MatrixMarket matrix coordinate complex hermitian\n"),
              HasSubstr("'coordinate complex hermitian'"));
  EXPECT_THAT(fault("a.mtx", head + "3 4 1\n1 1 1\n"), HasSubstr("a.mtx:2:3: the matrix must be square"));
  EXPECT_THAT(fault("a.mtx", head + "3 3 2\n1 1 1\n"), HasSubstr("1 entries follow, but the head states 2"));
  EXPECT_THAT(fault("a.mtx", head + "3 3 1\n1 1 1\n2 2 2\n"), HasSubstr("more entries follow"));
  EXPECT_THAT(fault("a.mtx", head + "3 3 1\n1 4 1\n"), HasSubstr("a.mtx:3:3: a row or column must be from 1 to 3"));
  EXPECT_THAT(fault("a.mtx", head + "3 3 1\n1 1 nan\n"), HasSubstr("a.mtx:3:5: 'nan' is not a finite number"));
  EXPECT_THAT(fault("a.mtx", head + "3 3 1\n1 1\n"), HasSubstr("a.mtx:3:1: an entry must be"));
  EXPECT_THAT(fault("a.mtx", head + "99999999999 99999999999 1\n"), HasSubstr("number of rows must be from 1 to"));
  EXPECT_THAT(fault("a.mtx", head + "1 1 1\n1 1 1\n", "KAAX"), HasSubstr("have no names"));
  EXPECT_THAT(fault("a.csv", "1, 2\n3, 4\n"),
              HasSubstr("not symmetric: 3 in row 2 and column 1, 2 in the mirrored position"));
  EXPECT_THAT(fault("a.csv", "1, 2\n2\n"), HasSubstr("a.csv:2:1: this row has 1 number, the first has 2"));
  EXPECT_THAT(fault("a.csv", "1, 2\n"), HasSubstr("1 row and 2 columns"));
  EXPECT_THAT(fault("a.csv", "# nothing\n"), HasSubstr("no numbers"));
  EXPECT_THAT(fault("lone.sti", "1 1 1\n"), HasSubstr("lone.dof"));
  write_text(folder / "b.dof", "1.1\n1.9\n");
  EXPECT_THAT(fault("b.sti", "1 1 1\n"), HasSubstr("b.dof:2:1: must be NODE.COMPONENT"));
  write_text(folder / "b.dof", "1.1\n1.2\n");
  EXPECT_THAT(fault("b.sti", "1 3 1\n"), HasSubstr("b.sti:1:3: a row or column must be from 1 to 2"));
  EXPECT_THAT(fault("a.pch", "GRID,1\n"), HasSubstr("no DMIG matrix"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,6,1,0\nDMIG,KB,0,6,1,0\n"),
              HasSubstr("the file has KA, KB; select one with --stiffness-name"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,6,1,0\n", "KAX"), HasSubstr("no matrix 'KAX'; did you mean 'KA'?"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,2,1,0\n"), HasSubstr("a.pch:1:11: the form of matrix KA must be 6"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,6,3,0\n"), HasSubstr("must be real"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,6,1,0\n"), HasSubstr("matrix KA has no entries"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,6,1,0\nDMIG,KA,1,7,,1,1,2.0\n"),
              HasSubstr("a.pch:2:9: must be a node and its component"));
  EXPECT_THAT(fault("a.pch", "DMIG,KA,0,6,1,0\nDMIG,KA,1,1,,1,1,two\n"), HasSubstr("'two' is not a finite number"));
  const std::string one = output4("KXX", Eigen::MatrixXd::Identity(2, 2), Output4Layout::dense);
  EXPECT_THAT(fault("a.op4", "nothing\n"), HasSubstr("a.op4:1:1: the head of a matrix"));
  EXPECT_THAT(fault("a.op4", one.substr(0, one.size() / 2)), HasSubstr("a.op4:"));
  EXPECT_THAT(fault("a.op4", ""), HasSubstr("no OUTPUT4 matrix"));
  // Cut anywhere, or with a byte changed: a fault or a matrix, never a crash.
  const std::string texts[] = {
      one,
      dmig("KA", Eigen::MatrixXd::Identity(3, 3), DmigFields::wide),
      matrix_market_list(Eigen::MatrixXd::Identity(3, 3)),
      output4("KXX", Eigen::MatrixXd::Identity(3, 3), Output4Layout::strings),
      output4_binary("KXX", Eigen::MatrixXd::Identity(3, 3), Output4Bytes()),
      output4_binary("KXX", Eigen::MatrixXd::Identity(3, 3), {true, 8, 4, false, false, Output4Layout::strings}),
      abaqus_labels(Eigen::MatrixXd::Identity(3, 3))};
  const char* names[] = {"c.op4", "c.pch", "c.mtx", "d.op4", "e.op4", "f.op4", "e.mtx"};
  for (std::size_t k = 0; k < std::size(texts); ++k) {
    for (std::size_t at = 0; at < texts[k].size(); at += 3) {
      for (const bool is_cut : {true, false}) {
        std::string damaged = is_cut ? texts[k].substr(0, at) : texts[k];
        if (!is_cut) damaged[at] = "9-x \n"[at % 5];
        write_text(folder / names[k], damaged);
        FaultList faults;
        const auto matrix = read_element_matrix(folder / names[k], "", 'K', faults);
        EXPECT_NE(matrix.has_value(), !faults.empty()) << damaged;
      }
    }
  }
}

TEST(ElementMatrixFiles, MatchingMatrices) {
  const FrameModel model = bent_mast(2);
  ElementMatrix M = model.mass(), K = model.stiffness();
  FaultList faults;
  K.dofs.clear();
  EXPECT_FALSE(align(M, K, faults));
  EXPECT_THAT(faults.all().back().message, HasSubstr("the rows have no names"));
  M.dofs.clear();
  K.A.conservativeResize(6, 6);
  EXPECT_FALSE(align(M, K, faults));
  EXPECT_THAT(faults.all().back().message, HasSubstr("not of the same model"));
  // Rows that one of them lacks are zero there.
  ElementMatrix small{"small", Eigen::MatrixXd::Identity(2, 2).sparseView(), {{9, 1}, {3, 2}}};
  ElementMatrix large{"large", Eigen::MatrixXd::Identity(3, 3).sparseView(), {{1, 1}, {9, 1}, {3, 2}}};
  EXPECT_TRUE(align(small, large, faults));
  EXPECT_EQ(small.dofs, (std::vector<ElementDof>{{1, 1}, {3, 2}, {9, 1}}));
  EXPECT_EQ(Eigen::MatrixXd(small.A).diagonal(), Eigen::Vector3d(0, 1, 1));
}

TEST(NodePlaces, ReadWithLineNumbers) {
  TemporaryFolder folder;
  write_text(folder / "nodes.csv", "# node, x, y, z\n12, 0, 1.5, -2\n\n13 1 2 3  # blanks do as well\n");
  FaultList faults;
  const auto places = read_node_places(folder / "nodes.csv", faults);
  ASSERT_EQ(places.size(), 2u);
  EXPECT_EQ(places[0].node, 12);
  EXPECT_EQ(places[0].y, 1.5);
  EXPECT_EQ(places[1].mark.line, 4);
  for (const char* text : {"12, 0, 1.5\n", "12, 0, 1, x\n", "1.5, 0, 0, 0\n", "\n", "1 0 0 0\n1 1 1 1\n"}) {
    write_text(folder / "nodes.csv", text);
    FaultList found;
    read_node_places(folder / "nodes.csv", found);
    EXPECT_EQ(found.size(), 1u) << text;
  }
}

}  // namespace element_matrix_test
}  // namespace grapnel::testing
