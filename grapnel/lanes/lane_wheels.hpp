#pragma once

/// @file
/// Reaction wheels in packs: distribution of a base torque to their motors, (1) of simulate/reaction_wheels.hpp. All
/// wheels are below saturation here. A case in which a wheel approaches its maximum rate leaves the lanes before the
/// step that may reach it (LaneStatus::at_largest_rate), since modes change at events, at different times in each case.

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/spatial/pack.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel::lanes {

template <class S>
class LaneWheels {
 public:
  using Mask = typename S::Mask;

  explicit LaneWheels(const PhaseTables& tables)
      : tables_(tables), link_(tables.outside.wheel_count), wheels_(tables.outside.wheel_count) {
    for (int i = 0; i < tables.link_count; ++i) {
      if (tables.links[i].wheel >= 0) link_[tables.links[i].wheel] = i;
    }
  }

  bool any() const { return tables_.outside.wheel_count > 0; }

  /// Loads a case's numbers into a lane.
  void load_case(int lane, const CaseRecord& record) {
    const double* n = record.outside + kLoads + kLoadNumbers * tables_.outside.load_count;
    for (int w = 0; w < tables_.outside.wheel_count; ++w, n += kWheelNumbers) {
      Wheel& wheel = wheels_[w];
      for (int k = 0; k < 3; ++k) wheel.row[k].set(lane, n[kWheelRow + k]);
      wheel.torque.set(lane, n[kWheelTorque]);
      wheel.rate.set(lane, n[kWheelRate]);
    }
  }

  /// Motor efforts, per link, that produce a torque on the base, in its axes.
  void distribute(const Vector3<S>& torque, S* motor) const {
    S factor(1.0);
    for (int w = 0; w < tables_.outside.wheel_count; ++w) {
      const S u = abs(dot(wheels_[w].row, torque));
      factor = select(u > wheels_[w].torque, min(factor, S(wheels_[w].torque / u)), factor);
    }
    for (int w = 0; w < tables_.outside.wheel_count; ++w) motor[link_[w]] = -(factor * dot(wheels_[w].row, torque));
  }

  /// Lanes in which a wheel may have reached its maximum rate during a step of length h, from its rates and
  /// accelerations at both ends. A parabola between equal rates rises by a quarter of acceleration times length; the
  /// test allows twice that. `begin`, `end`: velocities; `slope_begin`, `slope_end`: their derivatives.
  Mask near_largest_rate(const S* begin, const S* end, const S* slope_begin, const S* slope_end, const S& h) const {
    Mask near = Mask::from_bits(0);
    for (int w = 0; w < tables_.outside.wheel_count; ++w) {
      const int v = tables_.links[link_[w]].v;
      const S fastest = max(abs(begin[v]), abs(end[v]));
      const S rise = S(S(0.5) * abs(h)) * max(abs(slope_begin[v]), abs(slope_end[v]));
      near = near | (S(fastest + rise) >= wheels_[w].rate);
    }
    return near;
  }

 private:
  struct Wheel {
    Vector3<S> row;
    S torque, rate;
  };

  const PhaseTables& tables_;
  LaneArray<S, int> link_;
  LaneArray<S, Wheel> wheels_;
};

}  // namespace grapnel::lanes
