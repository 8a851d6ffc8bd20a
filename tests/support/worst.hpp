#pragma once

/// @file
/// The largest of many measured deviations, and its case; printed to keep the measured values in comments up to date.

#include <cmath>
#include <cstdio>
#include <string>

namespace grapnel::testing {

class Worst {
 public:
  explicit Worst(std::string name) : name_(std::move(name)) {}
  ~Worst() { std::printf("[ measured ] %s: %.3g (at %d)\n", name_.c_str(), value_, where_); }
  Worst(const Worst&) = delete;
  Worst& operator=(const Worst&) = delete;

  /// Records and returns the deviation. NaN counts as infinite.
  double note(double deviation, int where) {
    if (std::isnan(deviation)) deviation = INFINITY;
    if (deviation > value_) value_ = deviation, where_ = where;
    return deviation;
  }
  double value() const { return value_; }

 private:
  std::string name_;
  double value_ = 0;
  int where_ = -1;
};

}  // namespace grapnel::testing
