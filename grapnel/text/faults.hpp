#pragma once

/// @file
/// Errors and warnings of input files with their locations.

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace grapnel {

/// One error of the input, or a warning about valid but implausible input.
struct Fault {
  std::string file;  // path as the user gave it, or "--set path=value"
  int line = 0;      // 1-based; 0: no location in the file (it cannot be read, or the value comes from an override)
  int column = 0;    // 1-based, in characters
  std::string message;
  bool is_warning = false;

  /// "file:line:column: error: message" (or "warning"), always one line.
  std::string text() const;

  friend bool operator==(const Fault&, const Fault&) = default;
};

/// In the order of file, line and column, each once.
std::vector<Fault> sorted_faults(std::vector<Fault> faults);

/// Thrown when a scenario or robot is rejected. Contains all errors, sorted by file, line and column; what() is their
/// texts, one per line.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Fault> faults);
  const std::vector<Fault>& faults() const { return faults_; }

 private:
  std::vector<Fault> faults_;
};

/// A location in a source: a file, or an override (line 0).
struct Mark {
  std::shared_ptr<const std::string> source;
  int line = 0;
  int column = 0;
};

/// Collects errors; the caller builds the messages. Stops at kMost errors, which bounds the time for malicious input.
/// Warnings about valid but implausible input are stored separately and do not reject the input.
class FaultList {
 public:
  static constexpr std::size_t kMost = 1000;
  /// Longer messages are truncated: lists in them may have thousands of names.
  static constexpr std::size_t kLongestMessage = 2000;  // [bytes]

  void add(const Mark& mark, std::string message) {
    add(Fault{mark.source ? *mark.source : std::string(), mark.line, mark.column, std::move(message)});
  }
  void add(Fault fault);
  void warn(const Mark& mark, std::string message) {
    warn(Fault{mark.source ? *mark.source : std::string(), mark.line, mark.column, std::move(message)});
  }
  void warn(Fault warning);
  bool full() const { return faults_.size() > kMost; }
  bool empty() const { return faults_.empty(); }
  std::size_t size() const { return faults_.size(); }
  const std::vector<Fault>& all() const { return faults_; }
  const std::vector<Fault>& warnings() const { return warnings_; }
  /// @throws InputError if there are any.
  void throw_if_any() {
    if (!faults_.empty()) throw InputError(std::move(faults_));
  }

 private:
  std::vector<Fault> faults_, warnings_;
};

}  // namespace grapnel
