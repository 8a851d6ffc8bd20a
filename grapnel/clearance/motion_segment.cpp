#include "grapnel/clearance/motion_segment.hpp"

#include <cmath>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

MotionSegment::MotionSegment(const Model& model)
    : model_(&model),
      cubics_(model.coordinates()),
      rates_begin_(model.coordinates()),
      rates_end_(model.coordinates()) {}

void MotionSegment::set(double t0, const State& begin, double t1, const State& end) {
  t0_ = t0;
  coordinate_rates(*model_, begin.q, begin.v, rates_begin_);
  coordinate_rates(*model_, end.q, end.v, rates_end_);
  for (std::size_t i = 0; i < cubics_.size(); ++i) {
    cubics_[i] = {begin.q[i], rates_begin_[i], end.q[i], rates_end_[i], t1 - t0};
  }
  // Of the two quaternions of the end's orientation, the one near the begin's.
  for (const int k : model_->quaternions()) {
    double product = 0;
    for (int i = k; i < k + 4; ++i) product += begin.q[i] * end.q[i];
    if (product >= 0) continue;
    for (int i = k; i < k + 4; ++i) cubics_[i].x1 = -cubics_[i].x1, cubics_[i].r1 = -cubics_[i].r1;
  }
}

void MotionSegment::interpolate(double t, State& state) const {
  for (std::size_t i = 0; i < cubics_.size(); ++i) state.q[i] = cubics_[i].value((t - t0_) / cubics_[i].h);
  for (const int k : model_->quaternions()) {
    double square = 0;
    for (int i = k; i < k + 4; ++i) square += state.q[i] * state.q[i];
    for (int i = k; i < k + 4; ++i) state.q[i] /= std::sqrt(square);
  }
}

}  // namespace grapnel
