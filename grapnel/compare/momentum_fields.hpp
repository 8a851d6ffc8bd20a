#pragma once

/// @file
/// Descriptions of momentum_report.hpp, for the reports that contain them.

#include "grapnel/compare/momentum_report.hpp"
#include "grapnel/describe/type.hpp"

namespace grapnel {

template <>
struct Described<MeasuredComponent> {
  using T = MeasuredComponent;
  static constexpr Field fields[] = {
      field<&T::name>("name", "component; of impulses along the axes of W, on the robot"),
      field<&T::unit>("unit", "its unit"),
      field<&T::determined>("determined", "whether the measured quantities determine it"),
      field<&T::value>("value", "as `unit`", "estimate; absent: not determined"),
      field<&T::uncertainty>("uncertainty", "as `unit`", "its standard uncertainty"),
      field<&T::simulated>("simulated", "as `unit`", "value of the run; absent: the run has none"),
  };
  static constexpr Type type =
      structure<T>("MeasuredComponent", "a component of an impulse or momentum of measured motion.", fields);
};

template <>
struct Described<MomentumReport> {
  using T = MomentumReport;
  static constexpr Field fields[] = {
      field<&T::body>("body", "robot, or the name of a target"),
      field<&T::missing>("missing", "series that the log does not measure completely; they would determine more"),
      field<&T::samples>("samples", "1", "times in momentum.csv"),
      field<&T::first>("first", "at the first time; empty without samples"),
      field<&T::last>("last", "at the last time"),
  };
  static constexpr Type type = structure<T>(
      "MeasuredMomentum", "momentum and kinetic energy of measured motion; momentum.csv has all times.", fields);
};

}  // namespace grapnel
