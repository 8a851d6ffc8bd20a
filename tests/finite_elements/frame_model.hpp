#pragma once

/// @file
/// A finite-element model for tests: straight spatial beam elements with consistent masses, and its matrices in every
/// supported file format.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/import/element_matrix.hpp"

namespace grapnel::testing {

struct FrameSection {
  double EA = 7e6, EIy = 900, EIz = 400, GJ = 300;  // [N], [N m^2]
  double mass_per_length = 2, polar = 0.003;        // [kg/m], [kg m] about its axis
};

/// Nodes numbered from 0, each with six components: translations, rotations.
struct FrameModel {
  std::vector<Eigen::Vector3d> nodes;
  Eigen::MatrixXd M, K;

  explicit FrameModel(std::vector<Eigen::Vector3d> places);
  void add_beam(int a, int b, const FrameSection& section);

  /// As read from a file with named rows; nodes are numbered from 101.
  ElementMatrix mass() const;
  ElementMatrix stiffness() const;
};

/// A beam along x from the origin, divided into equal elements.
FrameModel straight_beam(double length, int elements, const FrameSection& section = {});
/// A mast along x with an arm sideways and upwards at its end: all modes are coupled in several directions.
FrameModel bent_mast(int elements);

/// A new folder for a test's files, removed by the destructor.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

void write_text(const std::filesystem::path& path, const std::string& text);

// The formats as written by other programs.
std::string matrix_market_list(const Eigen::MatrixXd& A);   // symmetric
std::string matrix_market_array(const Eigen::MatrixXd& A);  // general
std::string table(const Eigen::MatrixXd& A);
std::string calculix(const Eigen::MatrixXd& A);
std::string calculix_dofs(const Eigen::MatrixXd& A);  // nodes numbered from 101
enum class DmigFields { wide, free };
std::string dmig(const std::string& name, const Eigen::MatrixXd& A, DmigFields fields);  // same numbering
enum class Output4Layout { dense, strings, wide_strings };
std::string output4(const std::string& name, const Eigen::MatrixXd& A, Output4Layout layout);
std::string abaqus_coordinates(const Eigen::MatrixXd& A);
std::string abaqus_labels(const Eigen::MatrixXd& A);  // nodes numbered from 101, one triangle

/// Binary OUTPUT4 format as written by Fortran programs.
struct Output4Bytes {
  bool is_big_endian = false;
  int word = 4, marker = 4;  // [bytes]
  bool is_single = false, is_complex = false;
  Output4Layout layout = Output4Layout::dense;
};
/// The imaginary part of complex matrices is 1 everywhere. The matrix may be rectangular.
std::string output4_binary(const std::string& name, const Eigen::MatrixXd& A, const Output4Bytes& form);

}  // namespace grapnel::testing
