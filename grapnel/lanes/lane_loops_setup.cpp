#include "grapnel/lanes/lane_loops_setup.hpp"

#include <algorithm>

#include "grapnel/constraint/loop_columns.hpp"

namespace grapnel::lanes {
namespace {

void put(const Posed& X, double* out) {
  std::copy(X.p.e, X.p.e + 3, out);
  for (int k = 0; k < 3; ++k) std::copy(X.R.m[k], X.R.m[k] + 3, out + 3 + 3 * k);
}

}  // namespace

std::string loop_obstacle(const Model& model, const PhaseSetup& setup) {
  if (setup.closures.empty()) return {};
  // Projection moves the coordinates of all roots, and a fixed one has none.
  for (const TreeLink<double>& link : model.tree().links) {
    if (link.joint == JointType::fixed) return "loops close on a base that is fixed or held";
  }
  if (!setup.project_loops || setup.loop_feedback != 0) return "loops are kept closed otherwise than by projection";
  for (const LoopClosure& closure : setup.closures) {
    const LoopPath path = make_loop_path(model, closure);
    if (!path.one_tree()) return "closures tie two trees";
    const int root = model.bodies()[static_cast<std::size_t>(closure.body_a)].root;
    if (root == setup.held_root) return "loops close on a base that is fixed or held";
  }
  return {};
}

std::vector<LoopTable> loop_tables(const Model& model, const PhaseSetup& setup) {
  std::vector<LoopTable> tables;
  for (const LoopClosure& closure : setup.closures) {
    const LoopPath path = make_loop_path(model, closure);
    tables.push_back({path.link_a, path.link_b, path.angular_count});
  }
  return tables;
}

std::vector<double> loop_numbers(const Model& model, const PhaseSetup& setup) {
  std::vector<double> numbers(setup.closures.size() * kLoopNumbers);
  double* out = numbers.data();
  for (const LoopClosure& closure : setup.closures) {
    const LoopPath path = make_loop_path(model, closure);
    put(path.X_aC, out + kLoopAC);
    put(path.X_bD, out + kLoopBD);
    std::copy(path.hinge_C.e, path.hinge_C.e + 3, out + kLoopHinge);
    for (int r = 0; r < path.angular_count; ++r)
      std::copy(path.angular_rows[r].e, path.angular_rows[r].e + 3, out + kLoopTurns + 3 * r);
    out[kLoopAngularScale] = path.angular_scale;
    out[kLoopLinearScale] = path.linear_scale;
    out += kLoopNumbers;
  }
  return numbers;
}

}  // namespace grapnel::lanes
