#pragma once

/// @file
/// The equations of a compliant impact in packs: a different instant of one impact in each lane. The stages of an
/// implicit step, the columns of its Jacobian and the samples of histories are independent of each other.

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/root_velocity_kernel.hpp"
#include "grapnel/impact/compliant_kernel.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel {

template <class S>
class PackedPoints : public CompliantPacks {
 public:
  PackedPoints(const CompliantTables& tables, const TreeLink<double>* links, int count)
      : tables_(tables),
        kernel_(tables, tree_of(links, count, tables)),
        y_(tables.size),
        dydt_(tables.size),
        effort_(tables.velocities),
        drive_efforts_(tables.velocities * S::kWidth) {}

  void evaluate(const CompliantPoints& points) override {
    for (int first = 0; first < points.count; first += S::kWidth) evaluate(points, first);
  }

 private:
  static constexpr int kLoadNumbers = 27;
  static_assert(sizeof(InterfaceLoad) == kLoadNumbers * sizeof(double));
  static_assert(sizeof(BasicInterfaceLoad<S>) == kLoadNumbers * sizeof(S));

  static Tree<S> tree_of(const TreeLink<double>* links, int count, const CompliantTables& tables) {
    Tree<S> tree;
    tree.coordinates = tables.coordinates, tree.velocities = tables.velocities;
    tree.links.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) tree.links.push_back(convert_link<S>(links[i]));
    return tree;
  }

  // Gathers rows of `size` numbers; lanes beyond the last point repeat the last one, and are not written back.
  static void gather(const double* rows, int size, int here, S* to) {
    double lanes[S::kWidth];
    for (int i = 0; i < size; ++i) {
      for (int l = 0; l < S::kWidth; ++l) lanes[l] = rows[(l < here ? l : here - 1) * size + i];
      to[i] = S::load(lanes);
    }
  }
  static void scatter(const S* from, int size, int here, double* rows, int stride) {
    double lanes[S::kWidth];
    for (int i = 0; i < size; ++i) {
      from[i].store(lanes);
      for (int l = 0; l < here; ++l) rows[l * stride + i] = lanes[l];
    }
  }

  void evaluate(const CompliantPoints& points, int first) {
    const int here = points.count - first < S::kWidth ? points.count - first : S::kWidth;
    S t;
    gather(points.t + first, 1, here, &t);
    gather(points.y + first * tables_.size, tables_.size, here, y_.data());
    kernel_.load(t, y_.data());
    write_loads(points, first, here);
    const int nq = tables_.coordinates, nv = tables_.velocities;
    if (points.q != nullptr) scatter(kernel_.q().data(), nq, here, points.q + first * nq, nq);
    if (points.v != nullptr) scatter(kernel_.v().data(), nv, here, points.v + first * nv, nv);
    const bool moves = points.dydt != nullptr && kernel_.has_rates();
    const S* const effort = (points.acceleration != nullptr || moves) ? drive_efforts(points, first, here) : nullptr;
    if (points.acceleration != nullptr || moves) kernel_.accelerate(effort);
    if (points.acceleration != nullptr)
      scatter(kernel_.acceleration().data(), nv, here, points.acceleration + first * nv, nv);
    if (points.dydt == nullptr) return;
    kernel_.rates(y_.data(), effort, dydt_.data());
    scatter(dydt_.data(), tables_.size, here, points.dydt + first * tables_.size, tables_.size);
  }

  void write_loads(const CompliantPoints& points, int first, int here) {
    if (points.loads == nullptr) return;
    const int count = tables_.interface_count();
    for (int i = 0; i < count; ++i) {
      scatter(reinterpret_cast<const S*>(&kernel_.load_of(i)), kLoadNumbers, here,
              reinterpret_cast<double*>(points.loads + first * count + i), kLoadNumbers * count);
    }
  }

  // The drive's efforts, lane by lane; null: no drive.
  const S* drive_efforts(const CompliantPoints& points, int first, int here) {
    if (points.efforts == nullptr) return nullptr;
    const int nq = tables_.coordinates, nv = tables_.velocities;
    for (int l = 0; l < here; ++l) {
      const int k = first + l;
      points.efforts(points.drive, points.t[k], points.q + k * nq, points.v + k * nv,
                     points.loads + k * tables_.interface_count(), drive_efforts_.data() + l * nv);
    }
    gather(drive_efforts_.data(), nv, here, effort_.data());
    return effort_.data();
  }

  const CompliantTables& tables_;
  CompliantKernel<S> kernel_;
  lanes::LaneArray<S> y_, dydt_, effort_;
  lanes::LaneArray<S, double> drive_efforts_;  // a row per lane
};

}  // namespace grapnel
