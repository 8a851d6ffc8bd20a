#pragma once

/// @file
/// Kinematics and dynamics of single states in lanes: the kernels of grapnel/dynamics on packs, one case per lane.

#include <optional>

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/composite_body_kernel.hpp"
#include "grapnel/dynamics/derivatives_kernel.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/newton_euler_kernel.hpp"
#include "grapnel/lanes/lane_states_tables.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

template <class S>
class LaneStates {
 public:
  static constexpr int kWidth = S::kWidth;

  LaneStates(const StatesTables& tables, const StateCases& cases);
  /// Computes cases `first` to `first` + kWidth - 1; lanes beyond the last case repeat it and write nothing.
  void run(std::int64_t first);

 private:
  void load(const StateRows& rows, LaneArray<S>& to, std::int64_t first) const;
  void write(const S* from, int size, double* to, std::int64_t first) const;
  void write_motion(std::int64_t first);
  void write_derivatives(const StateDerivatives& to, bool forward, std::int64_t first);
  template <class Entry>
  void write_rows(int rows, int columns, const Entry& entry, double* to, std::int64_t first);
  void differentiate(DynamicsInput<S>& in, std::int64_t first);
  static bool is_requested(const StateDerivatives& d) {
    return d.value != nullptr || d.dq != nullptr || d.dv != nullptr || d.other != nullptr || d.dwrench != nullptr;
  }
  std::span<S> all(LaneArray<S>& numbers) const { return {numbers.data(), static_cast<std::size_t>(numbers.size())}; }

  const StateCases& cases_;
  Tree<S> tree_;
  DynamicsWorkspace<S> workspace_;
  LaneArray<S> q_, v_, given_, result_, applied_, square_;
  LaneArray<S, LinkMotion<S>> motion_;
  LaneArray<S> numbers_;  // of motion_
  std::optional<derivatives::DerivativesKernel<S>> kernel_;
  LaneArray<S, derivatives::AppliedWrench<S>> wrenches_;
  LaneArray<S, double> row_;  // of a matrix, all lanes
};

/// The entry point of an instruction set.
template <class S>
void run_lane_states(const StatesTables& tables, const StateCases& cases) {
  LaneStates<S> states(tables, cases);
  for (std::int64_t first = 0; first < cases.count; first += S::kWidth) states.run(first);
}

template <class S>
LaneStates<S>::LaneStates(const StatesTables& tables, const StateCases& cases)
    : cases_(cases),
      q_(tables.coordinates),
      v_(tables.velocities),
      given_(tables.velocities),
      result_(tables.velocities),
      applied_(tables.velocities),
      square_(cases.mass_matrix != nullptr ? tables.velocities * tables.velocities : 0),
      motion_(cases.motion != nullptr ? tables.link_count : 0),
      numbers_(cases.motion != nullptr ? tables.link_count * kMotionNumbers : 0),
      wrenches_(cases.wrench_count),
      row_(kWidth * (tables.velocities > 6 * cases.wrench_count ? tables.velocities : 6 * cases.wrench_count)) {
  tree_.coordinates = tables.coordinates;
  tree_.velocities = tables.velocities;
  tree_.links.reserve(static_cast<std::size_t>(tables.link_count));
  for (int i = 0; i < tables.link_count; ++i) tree_.links.push_back(convert_link<S>(tables.links[i]));
  const bool recurses = cases.accelerations != nullptr || cases.forces != nullptr || cases.mass_matrix != nullptr;
  if (recurses) workspace_ = DynamicsWorkspace<S>(tree_);
  if (!is_requested(cases.forward) && !is_requested(cases.inverse)) return;
  kernel_.emplace(tree_, tables.derivatives);
  for (int e = 0; e < cases.wrench_count; ++e) {
    const StateWrench& w = cases.wrenches[e];
    derivatives::AppliedWrench<S>& to = wrenches_[e];
    to.link = w.link;
    for (int k = 0; k < 3; ++k)
      to.p_LP[k] = S(w.p_LP[k]), to.F_W.angular[k] = S(w.F_W[k]), to.F_W.linear[k] = S(w.F_W[3 + k]);
  }
}

template <class S>
void LaneStates<S>::load(const StateRows& rows, LaneArray<S>& to, std::int64_t first) const {
  double lanes[kWidth];
  for (int i = 0; i < to.size(); ++i) {
    for (int l = 0; l < kWidth; ++l) {
      const std::int64_t k = first + l < cases_.count ? first + l : cases_.count - 1;
      lanes[l] = rows.data == nullptr ? 0.0 : rows.data[k * rows.stride + i];
    }
    to[i] = S::load(lanes);
  }
}

template <class S>
void LaneStates<S>::write(const S* from, int size, double* to, std::int64_t first) const {
  double lanes[kWidth];
  for (int i = 0; i < size; ++i) {
    from[i].store(lanes);
    for (int l = 0; l < kWidth && first + l < cases_.count; ++l) to[(first + l) * size + i] = lanes[l];
  }
}

template <class S>
void LaneStates<S>::write_motion(std::int64_t first) {
  S* out = numbers_.data();
  for (int i = 0; i < motion_.size(); ++i) {
    const LinkMotion<S>& link = motion_[i];
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) *out++ = link.X_WL.R.m[r][c];
    for (int r = 0; r < 3; ++r) *out++ = link.X_WL.p[r];
    for (int r = 0; r < 3; ++r) *out++ = link.V_WL.angular[r];
    for (int r = 0; r < 3; ++r) *out++ = link.V_WL.linear[r];
  }
  write(numbers_.data(), numbers_.size(), cases_.motion, first);
}

// Row-major matrices of the cases in the lanes: entry(i, j) is one number of each. Row by row, so that every case's
// numbers are written one after another.
template <class S>
template <class Entry>
void LaneStates<S>::write_rows(int rows, int columns, const Entry& entry, double* to, std::int64_t first) {
  if (to == nullptr) return;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) entry(i, j).store(row_.data() + j * kWidth);
    for (int l = 0; l < kWidth && first + l < cases_.count; ++l) {
      double* const row = to + ((first + l) * rows + i) * columns;
      for (int j = 0; j < columns; ++j) row[j] = row_[j * kWidth + l];
    }
  }
}

template <class S>
void LaneStates<S>::write_derivatives(const StateDerivatives& to, bool forward, std::int64_t first) {
  const derivatives::DerivativesKernel<S>& d = *kernel_;
  const int n = result_.size();
  if (to.value != nullptr) write(forward ? d.vdot() : d.tau(), n, to.value, first);
  write_rows(
      n, n, [&](int i, int j) -> const S& { return d.by_q(i, j); }, to.dq, first);
  write_rows(
      n, n, [&](int i, int j) -> const S& { return d.by_v(i, j); }, to.dv, first);
  write_rows(
      n, n, [&](int i, int j) -> const S& { return d.by_other(i, j); }, to.other, first);
  if (to.dwrench == nullptr || cases_.wrench_count == 0) return;
  for (int i = 0; i < n; ++i) {
    S six[6];
    for (int e = 0; e < cases_.wrench_count; ++e) {
      d.wrench_row(wrenches_[e], i, six);
      for (int k = 0; k < 6; ++k) six[k].store(row_.data() + (6 * e + k) * kWidth);
    }
    const int columns = 6 * cases_.wrench_count;
    for (int l = 0; l < kWidth && first + l < cases_.count; ++l) {
      for (int j = 0; j < columns; ++j) to.dwrench[((first + l) * n + i) * columns + j] = row_[j * kWidth + l];
    }
  }
}

template <class S>
void LaneStates<S>::differentiate(DynamicsInput<S>& in, std::int64_t first) {
  load(cases_.acceleration, given_, first);
  in.acceleration = all(given_);
  const std::span<const derivatives::AppliedWrench<S>> wrenches(wrenches_.data(),
                                                                static_cast<std::size_t>(cases_.wrench_count));
  if (is_requested(cases_.inverse)) {
    kernel_->inverse({in, wrenches});
    write_derivatives(cases_.inverse, false, first);
  }
  if (is_requested(cases_.forward)) {
    load(cases_.force, applied_, first);
    in.force = all(applied_);
    if (cases_.prescribed != nullptr) in.prescribed = {cases_.prescribed, static_cast<std::size_t>(result_.size())};
    kernel_->forward({in, wrenches});
    write_derivatives(cases_.forward, true, first);
  }
}

template <class S>
void LaneStates<S>::run(std::int64_t first) {
  load(cases_.q, q_, first);
  load(cases_.v, v_, first);
  DynamicsInput<S> in;
  in.q = all(q_), in.v = all(v_);
  in.gravity = {S(cases_.gravity[0]), S(cases_.gravity[1]), S(cases_.gravity[2])};
  if (cases_.motion != nullptr) {
    const std::span<const S> v = cases_.v.data == nullptr ? std::span<const S>() : in.v;
    link_motion<S>(tree_, in.q, v, {motion_.data(), static_cast<std::size_t>(motion_.size())});
    write_motion(first);
  }
  if (cases_.accelerations != nullptr) {
    load(cases_.force, given_, first);
    in.force = all(given_);
    articulated_body<S>(tree_, in, workspace_, all(result_), all(applied_));
    write(result_.data(), result_.size(), cases_.accelerations, first);
  }
  if (cases_.forces != nullptr) {
    if (cases_.acceleration.data != nullptr) {
      load(cases_.acceleration, given_, first);
      in.acceleration = all(given_);
    }
    newton_euler<S>(tree_, in, workspace_, all(result_));
    write(result_.data(), result_.size(), cases_.forces, first);
  }
  if (cases_.mass_matrix != nullptr) {
    composite_body<S>(tree_, in.q, workspace_, all(square_));
    write(square_.data(), square_.size(), cases_.mass_matrix, first);
  }
  if (kernel_) differentiate(in, first);
}

}  // namespace grapnel::lanes
