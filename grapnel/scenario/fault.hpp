#pragma once

/// @file
/// Faults of input files, each with its place. Thread safety: plain values.

#include <stdexcept>
#include <string>
#include <vector>

namespace grapnel {

/// One fault of the input, or something in it that is allowed but hardly meant.
struct Fault {
  std::string file;  // path as the user gave it, or "--set path=value"
  int line = 0;      // 1-based; 0: the fault has no place in the file (it cannot be read, or comes from an override)
  int column = 0;    // 1-based, in characters
  std::string message;
  bool is_warning = false;

  /// "file:line:column: error: message" (or "warning"), always one line.
  std::string text() const;

  friend bool operator==(const Fault&, const Fault&) = default;
};

/// In the order of file, line and column, each once.
std::vector<Fault> sorted_faults(std::vector<Fault> faults);

/// Thrown when a scenario or robot cannot be accepted. Carries every fault found, sorted by file, line and column;
/// what() is their texts, one a line.
class ScenarioError : public std::runtime_error {
 public:
  explicit ScenarioError(std::vector<Fault> faults);
  const std::vector<Fault>& faults() const { return faults_; }

 private:
  std::vector<Fault> faults_;
};

}  // namespace grapnel
