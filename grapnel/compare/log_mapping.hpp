#pragma once

/// @file
/// Mapping files: which columns of a log measure which quantities of a run. log_mapping.cpp describes every key;
/// docs/formats/comparison.md documents them.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// The word for an offset that the comparison determines.
enum class SearchedOffset { found };
/// The same for a drift.
enum class SearchedDrift { found };
enum class QuaternionOrder { wxyz, xyzw };

struct MappedTime {
  std::optional<std::string> column;
  std::optional<std::string> unit;
  std::variant<double, SearchedOffset> offset = 0.0;  // [s]
  std::optional<std::array<double, 2>> search;        // [s]
  std::variant<double, SearchedDrift> drift = 0.0;    // [1]
  double largest_drift = 5e-4;                        // [1]
  std::optional<double> reference;                    // of the log [s]
  std::optional<double> from, to;                     // of the run [s]
};

struct MappedQuantity {
  std::string run;
  std::variant<std::string, std::vector<std::string>> log;
  std::optional<std::string> name, time, unit, frame;
  double scale = 1;
  std::array<double, 4> axes = {1, 0, 0, 0};    // quaternion w, x, y, z
  std::optional<std::array<double, 3>> origin;  // [m]
  std::optional<std::array<double, 3>> marker;  // [m]
  QuaternionOrder quaternion_order = QuaternionOrder::wxyz;
  double average = 0;  // [s]
  // In `unit`, or with a unit in the file: amount_of().
  std::optional<double> uncertainty, bias_uncertainty;
  bool align = true;
};

struct LogMapping {
  MappedTime time;
  std::vector<MappedQuantity> quantities;
};

/// A mapping with the tree that it was read from, whose places messages name.
struct ReadMapping {
  LogMapping mapping;
  Node root;
};

/// Reads a mapping file. Errors are added to `faults`; empty: the file cannot be used.
std::optional<ReadMapping> read_mapping(const std::filesystem::path& path, FaultList& faults);

/// The published schema of mapping files.
std::string mapping_schema();

}  // namespace grapnel
